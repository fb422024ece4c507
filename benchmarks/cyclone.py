"""Classes for the Python package of Cyclone DDS, as text; its own IDL compiler writes the like."""

import re
from collections.abc import Iterable

HEAD = "from dataclasses import dataclass\nfrom cyclonedds.idl import IdlStruct, types\n\n"
#: The rest are of the same name in `cyclonedds.idl.types`.
NAMES = {"bool": "bool", "string": "str", "byte": "types.uint8", "char": "types.uint8"}
#: An element, and what makes an array of it.
TYPE = re.compile(r"(?P<element>[\w/]+)(?P<array>\[(?P<size>\d*)\])?$")


def class_name(name: str) -> str:
    """Return the class of `package/msg/Name` or, as in a field, `package/Name`."""
    package, *_, type_ = name.split("/")
    return f"{package}_{type_}"


def annotation(spelled: str) -> str:
    found = TYPE.match(spelled)
    assert found, f"no benchmark has a {spelled}"
    element = found["element"]
    kind = class_name(element) if "/" in element else NAMES.get(element, f"types.{element}")
    if not found["array"]:
        return kind
    return f"types.array[{kind}, {found['size']}]" if found["size"] else f"types.sequence[{kind}]"


def source(structures: Iterable[dict]) -> str:
    """Return a module of the structures, as `idlc show --format json` describes them."""
    lines = [HEAD]
    # what is used comes after what uses it
    for one in reversed(list(structures)):
        name = one["name"]
        options = f"IdlStruct, typename={name.replace('/', '.')!r}"
        fields = [f"    {f['name']}: {annotation(f['type'])}\n" for f in one["fields"]]
        lines += [f"@dataclass\nclass {class_name(name)}({options}):\n"]
        lines += [*(fields or ["    pass\n"]), "\n"]
    return "".join(lines)
