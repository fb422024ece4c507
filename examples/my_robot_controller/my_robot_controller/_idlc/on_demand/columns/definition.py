"""The definition of a type as recordings have it: MCAP calls it ros2msg."""

from __future__ import annotations

from ..typeinfo import FieldInfo, fields_of, types

#: What stands between a type and those that it refers to.
LINE = "=" * 80


def definition_of(name: str) -> str:
    """Return the text of a type, and of all that it refers to."""
    needed = [name]
    for one in needed:
        found = (field.nested for field in fields_of(one) if field.nested)
        needed += [other for other in dict.fromkeys(found) if other not in needed]
    parts = [_text(name)]
    parts += [f"{LINE}\nMSG: {_short(one)}\n{_text(one)}" for one in needed[1:]]
    return "".join(parts)


def _text(name: str) -> str:
    """Return a message file, or what its fields would be in one."""
    source = types()["sources"].get(name)
    if source is None or "/msg/" not in name:
        source = "".join(f"{_type(field)} {field.name}\n" for field in fields_of(name))
    return source if source.endswith("\n") else f"{source}\n"


def _type(field: FieldInfo) -> str:
    if field.nested:
        element = _short(field.nested)
    elif field.primitive:
        element = field.primitive.name
    else:
        bound = "" if field.text_bound is None else f"<={field.text_bound}"
        element = f"{'wstring' if field.wide else 'string'}{bound}"
    if field.size is not None:
        return f"{element}[{field.size}]"
    if field.bound is not None:
        return f"{element}[<={field.bound}]"
    return f"{element}[]" if field.is_sequence else element


def _short(name: str) -> str:
    package, _, short = name.split("/")
    return f"{package}/{short}"
