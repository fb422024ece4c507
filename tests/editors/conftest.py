"""The package that every editor is shown."""

import pytest

from tests.editors import scenario


@pytest.fixture
def package(tmp_path):
    return scenario.write(tmp_path / "workspace")
