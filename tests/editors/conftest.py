"""What every editor is shown."""

import pytest

from tests.editors import scenario


@pytest.fixture
def package(tmp_path):
    return scenario.write(tmp_path / "workspace")


@pytest.fixture
def workspace(tmp_path):
    """Two packages, one of which uses the message that is renamed."""
    return scenario.write(tmp_path / "workspace", scenario.RENAMING)
