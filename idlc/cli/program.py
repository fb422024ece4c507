"""How to call this program here, for the commands that messages name.

Cyclone DDS has a program called `idlc`, too, which may be the first one that a shell finds.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

#: What stands in our console scripts.
_OURS = b"idlc.cli.main"


def program() -> str:
    """Return `idlc` if that is this program, else another name for it."""
    for name in ("idlc", "rosidlc"):
        found = shutil.which(name)
        if found and _is_ours(Path(found)):
            return name
    return f"{Path(sys.executable).name} -m idlc"


def _is_ours(path: Path) -> bool:
    try:
        return _OURS in path.read_bytes()
    except OSError:
        return False
