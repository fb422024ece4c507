"""How an editor is started without a window, and what it then saw."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.editors.scenario import SETTINGS
from tests.support.paths import ROOT
from tests.support.waiting import WORK

HERE = Path(__file__).parent
#: Where editors keep what is theirs.
HOMES = ("HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME")


def environment(folder: Path, **variables: str) -> dict[str, str]:
    """Return the environment of an editor: no ROS, an empty home, and `rosidlc` on PATH."""
    found = {**os.environ, **dict.fromkeys(HOMES, str(folder / "home")), **variables}
    found["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return found


def see(package: Path, *command: object, patience: int = WORK, **variables: str) -> dict[str, Any]:
    """Return what an editor that runs a script wrote into the file that $SEEN names."""
    folder = package.parent
    seen = folder / "seen.json"
    (folder / "home").mkdir()
    done = subprocess.run(
        [str(word) for word in command],
        cwd=package,
        env=environment(folder, SEEN=str(seen), SETTINGS=SETTINGS, **variables),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=patience,
        check=False,
    )
    assert seen.exists(), done.stdout.decode(errors="replace")
    found: dict[str, Any] = json.loads(seen.read_text(encoding="utf-8"))
    return found


#: What is looked at in the package of the scenario, and in the workspace of its rename.
LOOKS = (
    "diagnostic fix hover definition built_in tag references completion rename format symbol "
    "inlay_hint update"
)


def neovim(
    program: object,
    package: Path,
    first: str = "msg/Drive.msg",
    look: str = LOOKS,
    setup: str = f"set runtimepath+={ROOT / 'editors' / 'neovim'}",
) -> Any:
    """Return what Neovim saw with the plugin, or after another command."""
    script = f"luafile {HERE / 'neovim.lua'}"
    commands = ("--cmd", "set noswapfile", "--cmd", setup, "-c", script)
    return see(package, program, "--headless", "--clean", *commands, FIRST=first, LOOK=look)


def neovim_renames(program: object, workspace: Path) -> dict[str, Any]:
    """Return the files after each rename of a message in Neovim."""
    return neovim(program, workspace, "fleet/msg/Robot.msg", "renaming")["renaming"]
