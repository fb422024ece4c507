"""Adding dependencies to the CMakeLists.txt of a scaffolded package of interfaces."""

from __future__ import annotations

import re
from collections.abc import Sequence

from idlc.scaffold.edits.outcome import Edited, Outcome, Refused

WHERE = "to the packages that rosidl_generate_interfaces() depends on, and find_package() it"
_LIST = re.compile(r"(?m)^set\(dependencies[ \t]*\r?\n(?P<names>(?:[ \t]+\w+[ \t]*\r?\n)*)\)")


def add_dependencies(text: str, names: Sequence[str]) -> Outcome:
    """Return the file with packages added to its list of dependencies."""
    missing = [name for name in names if not re.search(rf"\b{re.escape(name)}\b", text)]
    if not missing:
        return Edited(text)
    found = _LIST.search(text)
    if found is None:
        why = "there is no `set(dependencies ...)` with a line for each package"
        return Refused(why, " ".join(missing), WHERE)
    ending = "\r\n" if "\r\n" in found[0] else "\n"
    at = found.end("names")
    new = "".join(f"  {name}{ending}" for name in missing)
    return Edited(text[:at] + new + text[at:])
