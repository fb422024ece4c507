"""The functions that setuptools calls, so that a build compiles interfaces.

setuptools imports this module in every build, so it imports little.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

from idlc.diagnostics.text import Audience, addressed_to


def compile_at_build(distribution: Any, keyword: str, value: object) -> None:  # noqa: ARG001
    """Have setup(idlc_interfaces=True) compile the interfaces before its commands run.

    setuptools finds this function by its entry point. Without idlc it warns of an unknown option,
    and the package is built with the classes that were committed.
    """
    if not value:
        return

    def run_commands() -> None:
        del distribution.run_commands
        if "--dry-run" not in sys.argv:
            _compile(distribution)
        distribution.run_commands()

    distribution.run_commands = run_commands


def _compile(distribution: Any) -> None:
    """Bring the classes up to date, and have the commands install what rosidl installs beside them.

    These are the interfaces, their descriptions, libraries for C++ tools and the entries in ROS 2's
    index. They replace what `data_files` lists for the same places. Works in the folder of the
    setup.py that is run, and writes only classes there, and only where they changed. A rejected
    interface ends the build with a report.
    """
    from idlc.build.setup_command import compiled_class

    name = str(distribution.get_name())  # setuptools 78 has its own str for pyproject.toml's
    working_folder, source = Path.cwd(), Path("setup.py").resolve().parent
    os.chdir(source)
    try:
        with addressed_to(Audience.SETTINGS):
            distribution.__class__ = compiled_class(name, type(distribution))
    finally:
        os.chdir(working_folder)


def compile_library_at_build(distribution: Any) -> None:
    """Have setuptools compile the interfaces of a library that has no setup.py for it.

    setuptools calls this function, by its entry point, in every build of an environment with idlc.
    It has an effect if pyproject.toml names idlc in `requires` and has a table `[tool.idlc]`.
    """
    if getattr(distribution, "idlc_interfaces", False):
        return  # setup.py compiles them
    try:
        text = Path("pyproject.toml").read_text(encoding="utf-8")
        if not _TABLE.search(text):
            return
        from idlc.project.settings import toml

        document = toml(text)
        requires = document["build-system"]["requires"]
        concerned = "idlc" in document["tool"] and any(map(_REQUIREMENT.match, requires))
    except (OSError, ValueError, LookupError, TypeError):
        return  # setuptools reports what is wrong

    def run_commands() -> None:
        from idlc.build.library import build_command

        del distribution.run_commands
        build = distribution.get_command_class("build")
        commands = {"sub_commands": [*build.sub_commands, ("build_idlc", None)]}
        distribution.cmdclass["build"] = type("build", (build,), commands)
        distribution.cmdclass["build_idlc"] = build_command()
        distribution.run_commands()

    if concerned:
        distribution.run_commands = run_commands


_TABLE = re.compile(r"""\btool["']?\s*\.\s*["']?idlc\b|\bidlc["']?\s*[.=](?!=)""")
_REQUIREMENT = re.compile(r"\s*idlc(?![\w.-])", re.IGNORECASE)
