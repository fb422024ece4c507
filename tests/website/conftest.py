"""The site, built once."""

import os

import pytest

from idlc.project.atomic import exclusive
from maintenance.website.build import build


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """Return the folder of the site; building it is strict: a warning fails.

    Workers share it, as building takes long.
    """
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent
    folder = base / "website" / "site"
    with exclusive(folder):
        if not folder.exists():
            draft = base / "website" / "draft"
            build(draft)
            draft.rename(folder)
    return folder
