"""The site, built once."""

import pytest

from maintenance.website.build import build


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """Return the folder of the site; building it is strict: a warning fails."""
    folder = tmp_path_factory.mktemp("website") / "site"
    build(folder)
    return folder
