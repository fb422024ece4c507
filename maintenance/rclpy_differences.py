"""List the names and arguments of rclpy that idlc.robot lacks, as docs/robot-nodes.md shows them.

  Usage: python -m maintenance.rclpy_differences

rclpy must be installed. `IDLC_REFRESH=1 pytest tests/ros/test_rclpy_differences.py` writes the
list into the page.
"""

from __future__ import annotations

import ast
import inspect
import pkgutil
import textwrap
from collections.abc import Iterator
from contextlib import suppress
from enum import Enum
from importlib import import_module
from typing import Any, TypeGuard

from idlc.robot.offer import OFFERED, attribute

#: Parts of rclpy that no node imports.
_INTERNAL = ("rclpy.impl", "rclpy.experimental", "rclpy.type_hash", "rclpy.topic_or_service")
#: Classes that only rclpy itself makes objects of, and members for rclpy itself.
_MADE = ("Client", "Publisher", "Service", "Subscription", "Timer", "GuardCondition")
_MADE += ("ClientGoalHandle", "LifecyclePublisher", "ServerGoalHandle")
_HANDLES = ("handle", "name", "value", "add_to_wait_set", "get_num_entities", "is_ready")
_HANDLES += ("take_data", "create_event_handlers", "get_c_duration", "get_c_qos_profile")
_WIDTH = 120


def modules() -> list[str]:
    """Return the modules of rclpy that nodes can import."""
    import rclpy

    found = pkgutil.walk_packages(rclpy.__path__, "rclpy.")
    names = ["rclpy", *(module.name for module in found)]
    return [name for name in names if "._" not in name and not name.startswith(_INTERNAL)]


def names_of(module: Any) -> set[str]:
    """Return the public names that a module of rclpy defines, those of a package included."""
    own = {
        name
        for name, value in vars(module).items()
        if getattr(value, "__module__", "") == module.__name__
    }
    # a constant, or another name of something that is elsewhere
    for statement in ast.parse(inspect.getsource(module)).body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            own |= {each.id for each in ast.walk(statement) if _is_assigned(each)}
    own = {name for name in own if not name.startswith(("_", "g_"))}
    return own | {name for name in getattr(module, "__all__", ()) if hasattr(module, name)}


def _is_assigned(node: ast.AST) -> TypeGuard[ast.Name]:
    return isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)


def members_of(kind: type) -> dict[str, Any]:
    """Return the public members of a class, and its constructor."""
    members = {name: getattr(kind, name) for name in dir(kind) if not name.startswith("_")}
    if kind.__name__ not in _MADE and "__entries" not in vars(kind) and not issubclass(kind, Enum):
        members["__init__"] = kind.__init__  # type: ignore[misc]
    return {name: value for name, value in members.items() if name not in _HANDLES}


def arguments_of(function: Any) -> dict[str, bool] | None:
    """Return the arguments, and whether they are required; `None` if any or unknown ones are."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return None
    if any(each.kind in (each.VAR_POSITIONAL, each.VAR_KEYWORD) for each in parameters):
        return None
    required = {each.name: each.default is each.empty for each in parameters}
    return {name: required[name] for name in required.keys() - {"self", "cls"}}


def source_of(kind: type) -> str:
    """Return the source of a class of idlc, nothing for others."""
    if not kind.__module__.startswith("idlc."):
        return ""
    with suppress(OSError):  # an enum that is made by a call
        return inspect.getsource(kind)
    return ""


def lacking(real: Any, ours: Any, seen: set[int]) -> Iterator[str]:
    """Yield the members that idlc's object lacks, and the arguments of functions."""
    if not inspect.isclass(real):
        wanted, known = arguments_of(real), arguments_of(ours)
        if wanted is not None and known is not None:
            yield from (f"`{name}=`" for name in sorted(wanted.keys() - known.keys()))
            for name in sorted(wanted.keys() & known.keys()):
                if known[name] and not wanted[name]:
                    yield f"the default of `{name}=`"
        return
    present = {*dir(ours), *getattr(ours, "__annotations__", ())}
    text = "".join(map(source_of, getattr(ours, "__mro__", ())))
    for name, member in sorted(members_of(real).items()):
        definition = id(inspect.getattr_static(real, name))
        if definition in seen:  # it is inherited
            continue
        seen.add(definition)
        # attributes that the constructor sets are no members of the class
        if name not in present and f"self.{name}" not in text:
            yield f"`{name}`"
        elif callable(member):
            for argument in lacking(member, getattr(ours, name, None), seen):
                yield argument if name == "__init__" else f"{argument} of `{name}`"


def differences() -> Iterator[tuple[str, list[str]]]:
    """Yield each module of rclpy, or class in it, with what idlc lacks of it."""
    seen: set[int] = set()
    for name in sorted(modules(), key=lambda each: (".lifecycle" in each, each)):
        module = import_module(name)
        offered = set(OFFERED.get(name, "").split())
        if name not in OFFERED:
            continue
        if missing := sorted(f"`{each}`" for each in names_of(module) - offered):
            yield f"`{name}`", missing
        for each in sorted(offered & {*dir(module)}):
            real, ours = getattr(module, each), attribute(name, each)
            if callable(real) and id(real) not in seen and (parts := [*lacking(real, ours, seen)]):
                yield f"`{name}.{each}`", parts
            seen.add(id(real))


def listed() -> str:
    """Return the list in Markdown."""
    absent = [f"`{name}`" for name in modules() if name not in OFFERED]
    lines: list[str] = []
    for subject, parts in (("Modules", absent), *differences()):
        text = f"* {subject}: {', '.join(parts)}"
        lines += textwrap.wrap(
            text, _WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
        )
    return "\n".join(lines)


if __name__ == "__main__":
    print(listed())
