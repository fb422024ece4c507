"""The functions that setup.py and setuptools call, so that a build compiles interfaces.

setuptools imports this module in every build, so it imports little.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

from idlc.diagnostics.text import without_options


def compile_at_build(distribution: Any, keyword: str, value: object) -> None:  # noqa: ARG001
    """Have setup(idlc_interfaces=True) compile the interfaces before its commands run.

    setuptools finds this function by its entry point. Without idlc it warns of an unknown option,
    and the package is built with the classes that were committed.
    """
    if not value:
        return

    def run_commands() -> None:
        del distribution.run_commands
        name = str(distribution.get_name())  # setuptools 78 has its own str for pyproject.toml's
        compiled = compile_interfaces(name, type(distribution))
        distribution.__class__ = compiled.get("distclass", type(distribution))
        if hasattr(distribution, "set_defaults"):  # from setuptools 61 on
            distribution.set_defaults()
        generated = getattr(distribution, "generated", ())
        distribution.packages = sorted({*(distribution.packages or ()), *generated})
        distribution.run_commands()

    distribution.run_commands = run_commands


def compile_library_at_build(distribution: Any) -> None:
    """Have setuptools compile the interfaces of a library that has no setup.py for it.

    setuptools calls this function, by its entry point, in every build of an environment with idlc.
    It has an effect if pyproject.toml names idlc in `requires` and has a table `[tool.idlc]`.
    """
    if hasattr(distribution, "generated") or getattr(distribution, "idlc_interfaces", False):
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
        from idlc.build.library_command import build_command

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


def compile_interfaces(package: str, base: type | None = None) -> dict[str, type]:
    """Bring the package's classes up to date, and install what rosidl installs beside them.

    Returns further arguments for setup(), `setup(..., **compiled)`: with them it installs the
    interfaces, their descriptions, libraries for C++ tools and the entries in ROS 2's index. These
    replace what `data_files` lists for the same places. `base` is the class of distributions to
    extend, setuptools' own by default.

    Works in the folder of the setup.py that is run, and writes only classes there, and only where
    they changed. A rejected interface ends the build with a report.
    """
    if "--dry-run" in sys.argv:
        return {}  # colcon asks setup.py for the package's name whatever it is to do, to test too
    from idlc.build.setup_command import compiled_class

    working_folder, source = Path.cwd(), Path("setup.py").resolve().parent
    os.chdir(source)
    try:
        with without_options():
            return {"distclass": compiled_class(package, base)}
    finally:
        os.chdir(working_folder)
