"""Rules on how a package is built: what ROS 2's tools do with it as it is."""

from __future__ import annotations

import re
from collections.abc import Iterator

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic
from idlc.diagnostics.source import Span
from idlc.model.link import Model
from idlc.packaging.cmake import GENERATE, Call, Script
from idlc.packaging.facts import Facts
from idlc.packaging.layout import build_backend
from idlc.project.settings import toml

#: Commands of ROS 1's catkin, which ROS 2 lacks.
_CATKIN = frozenset({"add_message_files", "add_service_files", "generate_messages"})
#: Names of commands that may generate interfaces in a way that idlc does not know.
_GENERATING = re.compile(r"interface|msg|idl|generat|^autoware_package$")
_KNOWN = ("message", "rosidl_target_interfaces", "rosidl_get_", "target_", "ament_export_", "set_")
_TARGETS = frozenset({"add_library", "add_executable", "add_custom_target", GENERATE})
_PYTHON_PACKAGE = "ament_python_install_package"
_LINE = "<export><build_type>{}</build_type></export>"


def obstacles(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """Report what keeps ROS 2's tools from building the package with its interfaces."""
    script = Script(facts.cmake) if facts.cmake else None
    types = facts.declared("build_type")
    if _is_of_ros1(facts, script):
        port = f"call `{GENERATE}`" if model.own else "replace catkin's commands"
        yield codes.CANNOT_BUILD.at(
            facts.place,
            f"`{facts.name}` is a package for ROS 1: it is built with catkin, which ROS 2 lacks",
            hint=f"for ROS 2, write `{_LINE.format('ament_cmake')}` in package.xml, and {port} in "
            "CMakeLists.txt",
        )
    elif not types and (build_type := _probable_type(facts, script)):
        yield codes.CANNOT_BUILD.at(
            facts.place,
            "package.xml has no `<build_type>`, so colcon builds the package with catkin",
            hint=f"add `{_LINE.format(build_type)}`",
        )
    elif "ament_cmake" in types and model.own and script is None:
        yield codes.CANNOT_BUILD.at(
            facts.place,
            "the build type is `ament_cmake`, but there is no CMakeLists.txt",
            hint=f"write one that calls `{GENERATE}`",
        )
    elif "ament_python" in types and len(types) == 1 and not facts.setup_py:
        if not other_backend(facts):
            yield codes.CANNOT_BUILD.at(
                types["ament_python"].span,
                "the build type is `ament_python`, but there is no setup.py, which colcon runs",
                hint="run `idlc init`, which writes one",
            )
    elif script is not None and facts.build_type == "ament_cmake" and model.own:
        yield from _of_cmake(facts, script)


def other_backend(facts: Facts) -> str:
    """Return the build backend of a package without setup.py, if it is not setuptools."""
    if facts.setup_py or facts.pyproject is None:
        return ""
    try:
        document = toml(facts.pyproject.text)
    except ValueError:
        return ""
    top = build_backend(document).partition(".")[0]
    return "" if top == "setuptools" else top


def unjudged(facts: Facts) -> str | None:
    """Return a note if the package is built by something that idlc does not know."""
    if backend := other_backend(facts):
        return f"`{facts.manifest.path}`: idlc does not check which files {backend} installs"
    script = Script(facts.cmake) if facts.cmake and facts.files else None
    if script is None or script.generating or _is_of_ros1(facts, script):
        return None
    unknown = _unknown(script)
    if not unknown:
        return None
    return (
        f"`{script.commands[0].span.source.path}` does not call `{GENERATE}`, and idlc does not "
        f"know `{unknown}`"
    )


def _is_of_ros1(facts: Facts, script: Script | None) -> bool:
    if facts.declared("build_type").keys() - {"catkin", "cmake"}:
        return False
    names = {call.name for call in script.commands} if script else set()
    needs = facts.declared("buildtool_depend", "build_depend", "depend")
    return bool(_CATKIN & names) or not {"catkin", "message_generation"}.isdisjoint(needs)


def _probable_type(facts: Facts, script: Script | None) -> str:
    """Return the build type of a package that has none, by the files that only ROS 2 has."""
    if script and any(call.words[:1] == ("ament_cmake",) for call in script.commands):
        return "ament_cmake"
    is_python = facts.setup_py and "ament_index" in facts.setup_py.text
    return "ament_python" if is_python and script is None else ""


def _of_cmake(facts: Facts, script: Script) -> Iterator[Diagnostic]:
    """Yield what keeps CMake from generating interfaces."""
    if not script.generating and not script.reads_others and not _unknown(script):
        files = " ".join(sorted(facts.files.values()))
        yield codes.CANNOT_BUILD.at(
            facts.place,
            f"CMakeLists.txt does not call `{GENERATE}`, so the build installs no interface",
            hint=f"add `{GENERATE}(${{PROJECT_NAME}} {files})` before `ament_package()`",
        )
    made: dict[str, Call] = {}
    for call in script.unconditional:
        if call.name in _TARGETS and (name := _expanded(call, facts)):
            first = made.setdefault(name, call)
            is_interface = GENERATE in (first.name, call.name)
            if first is not call and is_interface:
                yield codes.CANNOT_BUILD.at(
                    _name(call),
                    f"two targets have the name `{name}`, which CMake refuses",
                    hint=f"name one of them `{name}_library`, for example",
                )
    installs = [call for call in script.generating if "SKIP_INSTALL" not in call.words]
    for call in script.unconditional:
        if call.name == _PYTHON_PACKAGE and installs and _expanded(call, facts) == facts.name:
            yield codes.CANNOT_BUILD.at(
                _name(call),
                f"`{GENERATE}` installs the Python package `{facts.name}`, too, and CMake refuses "
                "a second one",
                hint="move the Python code to another package, or give its folder another name",
            )


def _unknown(script: Script) -> str:
    """Return a command that may generate interfaces, by its name; empty if there is none."""
    names = (call.name for call in script.commands if not call.name.startswith(_KNOWN))
    return next(filter(_GENERATING.search, names), "")


def _expanded(call: Call, facts: Facts) -> str:
    """Return the first word of a command, if it is literal or the project's name."""
    word = call.words[0] if call.words else ""
    name = re.sub(r"\$\{PROJECT_NAME\}", facts.name, word)
    return "" if "$" in name else name


def _name(call: Call) -> Span:
    return Span(call.span.source, call.span.start, call.span.start + len(call.name))
