"""The proof that a package works: its installed copy is imported by a fresh interpreter.

Installing runs the package's own build. `idlc init` does so only after the user agreed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import suppress
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from idlc.diagnostics.text import one_line
from idlc.project.find import SKIPPED
from idlc.project.settings import SETTINGS_FILE, toml

_IMPORT = """\
import sys
from importlib import import_module
sys.path.insert(0, sys.argv[1])
for name in sys.argv[2:]:
    module, _, name = name.rpartition(".")
    getattr(import_module(module), name)
"""
#: Calls the build backend as pip does. But pip would wait for all processes that a build leaves
#: behind, because it reads their output.
_BUILD = """\
import sys
from importlib import import_module
wheels, backend, *places = sys.argv[1:]
sys.path[:0] = places
module, _, name = backend.partition(":")
hooks = import_module(module)
for part in filter(None, name.split(".")):
    hooks = getattr(hooks, part)
sys.argv = ["setup.py"]
hooks.build_wheel(wheels)
"""
#: Seconds for a build, and for an import.
_PATIENCE = 600
#: Bytes of output in which its last lines are searched.
_LAST = 1 << 16
_PIP = ("install", "--quiet", "--disable-pip-version-check", "--no-index", "--no-deps")
#: Folders of a project that no build reads, besides outputs of others.
_LEFT_OUT = (".git", ".hg", ".venv", "venv", ".tox", ".nox", "*.egg-info", *sorted(SKIPPED))


class Proof(NamedTuple):
    """A sentence on what was tried, and why it failed: empty if it worked."""

    tried: str
    failure: str = ""


def missing_tool(backend: str) -> str:
    """Return the module that a build needs and that is not installed here; empty if none is."""
    top = backend.partition(".")[0]
    for name in ("pip", top):
        if not name.isidentifier() or (name not in sys.modules and find_spec(name) is None):
            return one_line(name)
    if top == "setuptools" and find_spec("wheel") is None:
        digits = [int(part) for part in version(top).split(".")[:2] if part.isdigit()]
        return "wheel" if digits < [70, 1] else ""  # from 70.1 on, setuptools has its own
    return ""


def prove(folder: Path, backend: str, classes: tuple[str, ...], source: Path) -> Proof:
    """Install a copy of a package and import classes from it, if there are any.

    Without a backend, or if the tools are missing, they are imported from `source`.
    """
    count = f"{len(classes)} class{'es' * (len(classes) > 1)}"
    missing = missing_tool(backend) if backend else ""
    with tempfile.TemporaryDirectory(prefix="idlc-") as scratch:
        site = Path(scratch, "site")
        if not backend or missing:
            why = f" ({missing} is not installed here, so idlc built nothing)" if missing else ""
            tried = f"import {count} from the generated code in a new interpreter{why}"
            if not classes:
                return Proof("")
            return Proof(tried, _failure(Path(scratch), "-I", "-c", _IMPORT, source, *classes))
        # a link out of the package would be followed by the build
        ignore = shutil.ignore_patterns(*_LEFT_OUT)
        copy = Path(scratch, "copy", folder.name)  # no name hides a module or `site`
        try:
            shutil.copytree(folder, copy, symlinks=True, ignore=ignore)
        except shutil.Error as error:  # such as one for a named pipe
            return Proof("copy the package", one_line(str(error.args[0][0][2])))
        tried = "install a copy with pip"
        wheels = Path(scratch, "wheels")
        wheels.mkdir()
        build = Path(scratch, "build_wheel.py")  # its folder is on the path, not the package's
        build.write_text(_BUILD, encoding="utf-8")
        failure = _failure(copy, build, wheels, *_hooks(copy, backend))
        if not failure:
            install = ("-m", "pip", *_PIP, "--target", site, *wheels.iterdir())
            failure = _failure(Path(scratch), *install)
        if classes and not failure:
            tried += f", and import {count} from it in a new interpreter"
            failure = _failure(Path(scratch), "-I", "-c", _IMPORT, site, *classes)
        return Proof(tried, failure)


def _hooks(folder: Path, backend: str) -> list[str]:
    """Return the build backend's hooks as pip names them, and the folders to import it from."""
    system: dict[str, Any] = {}
    with suppress(OSError, ValueError, AttributeError):
        document = toml((folder / SETTINGS_FILE).read_text(encoding="utf-8"))
        system = document.get("build-system") or {}
    if "build-backend" not in system:
        return ["setuptools.build_meta:__legacy__"]
    places = system.get("backend-path", [])
    return [backend, *(str(folder / place) for place in places if isinstance(place, str))]


def _failure(folder: Path, *words: object) -> str:
    """Run Python in a folder; return the last lines that it printed if it fails.

    It prints to a file, because processes that a build leaves behind would hold a pipe open.
    """
    # backends look for their own programs there
    path = os.pathsep.join((str(Path(sys.executable).parent), *os.get_exec_path()))
    try:
        with tempfile.TemporaryFile() as output:
            done = subprocess.run(  # noqa: S603 - the user agreed to it
                [sys.executable, *map(str, words)],
                cwd=folder,
                env={**os.environ, "PATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                timeout=_PATIENCE,
                check=False,
            )
            output.seek(-min(output.tell(), _LAST), os.SEEK_CUR)
            text = output.read(_LAST).decode("utf-8", errors="replace")
    except subprocess.TimeoutExpired:
        return f"it did not finish within {_PATIENCE} seconds"
    except OSError as error:
        return f"Python did not start: {one_line(str(error))}"
    if not done.returncode:
        return ""
    lines = text.strip().splitlines()[-12:]
    return "\n".join(map(one_line, lines)) or f"it exited with status {done.returncode}"
