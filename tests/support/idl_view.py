"""The meaning of interface files and of the .idl files that they become, made comparable."""

import msgspec

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.escapes import through_idl
from idlc.language.parse import parse_any
from idlc.model import derive, ir
from idlc.model.ir import meaning
from idlc.model.lowering.lower import lower


def read(text, name, path=""):
    """Return what a text in either language means, without what its way through IDL loses."""
    is_idl = "\nmodule " in text and "struct " in text
    path = path or f"{name}.{'idl' if is_idl else name.kind}"
    report = Report()
    interface = lower(parse_any(Source(path, text)), name, report)
    assert not report.had_errors, [(one.code, one.message, one.where) for one in report]
    return meaning(interface if path.endswith(".idl") else as_idl(interface))


def as_idl(value):
    """Return what is left of IR: no `char`, no units but fields', escapes interpreted."""
    if isinstance(value, ir.Primitive):
        return ir.Primitive("uint8") if value.name == "char" else value
    if isinstance(value, msgspec.Struct):
        left = {name: as_idl(getattr(value, name)) for name in value.__struct_fields__}
        if "comment" in left:
            left["comment"] = tuple(map(through_idl, left["comment"]))
        if "unit" in left:
            is_field = isinstance(value, ir.Field) and value.unit is not None
            left["unit"] = through_idl(value.unit) if is_field else None
        if isinstance(value, ir.Message) and left["fields"] == DUMMY:
            left["fields"] = ()
        return type(value)(**left)
    if type(value) is tuple:
        return tuple(map(as_idl, value))
    return value


#: A field that somebody wrote looks like the one that stands for none.
DUMMY = (ir.Field(name=ir.DUMMY_FIELD, type=ir.Primitive("uint8")),)


def sections(interface):
    """Return the structures of an interface as IDL tells them."""
    return derive.sections(as_idl(interface))
