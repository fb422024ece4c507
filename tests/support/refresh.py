"""Which golden files a run rewrites, and that it fails then."""

import os
from fnmatch import fnmatch

import pytest

REFRESH = os.environ.get("IDLC_REFRESH", "")


def wanted(name):
    """Return whether `name` is to be rewritten: IDLC_REFRESH=1 is all, or it is a pattern."""
    return REFRESH == "1" or fnmatch(name, REFRESH)


def refreshed():
    """Fail, so that what was rewritten is looked at."""
    pytest.fail("refreshed: look at the difference, then run again without IDLC_REFRESH")
