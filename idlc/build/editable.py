"""The command of setuptools that makes an editable installation of idlc itself.

The build of idlc runs this file before idlc can be imported, so the file imports nothing of it.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

_build_py: Any = import_module("setuptools.command.build_py").build_py

_PACKAGE = """\
import importlib.util
import sys

spec = importlib.util.spec_from_file_location("idlc", {path!r})
sys.modules["idlc"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(sys.modules["idlc"])
"""


class build_py(_build_py):  # type: ignore[misc] # noqa: N801 - setuptools prints this name
    """Makes `idlc` importable wherever Python finds its entry points.

    setuptools, hatchling and pytest import what the entry points name. The import finder of an
    editable installation works only where Python runs .pth files, which it does not on PYTHONPATH.
    """

    def run(self) -> None:
        """Write a package that loads the one in the folder of sources."""
        super().run()
        if self.editable_mode:
            package = Path(self.get_finalized_command("install").install_lib, "idlc")
            package.mkdir()
            text = _PACKAGE.format(path=str(Path("idlc/__init__.py").resolve()))
            (package / "__init__.py").write_text(text, encoding="utf-8")
