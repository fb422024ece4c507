"""The site, built once."""

import pytest

from maintenance.website.build import build
from tests.support.shared import shared_folder


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """Return the folder of the site; building it is strict: a warning fails."""
    return shared_folder(tmp_path_factory, "website", build)
