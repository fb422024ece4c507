"""Adding dependencies to the CMakeLists.txt of a scaffolded package of interfaces."""

from __future__ import annotations

from collections.abc import Sequence

from idlc.checks.package.cmake import calls, listing
from idlc.diagnostics.edits import apply
from idlc.diagnostics.source import Source
from idlc.scaffold.edits.outcome import Edited, Outcome, Refused

WHERE = "to the packages that rosidl_generate_interfaces() depends on, and find_package() it"
_LIST = "dependencies"


def add_dependencies(text: str, names: Sequence[str]) -> Outcome:
    """Return the file with packages added to its list of dependencies."""
    commands = list(calls(Source("CMakeLists.txt", text)))
    there = {word for one in commands for word in one.words}
    missing = [name for name in names if name not in there]
    if not missing:
        return Edited(text)
    lists = [one for one in commands if one.name == "set" and one.words[:1] == (_LIST,)]
    if len(lists) != 1:
        why = f"there is no `set({_LIST} ...)`, or more than one"
        return Refused(why, " ".join(missing), WHERE)
    return Edited(apply(text, (listing(lists[0], name, listed=True) for name in missing))[0])
