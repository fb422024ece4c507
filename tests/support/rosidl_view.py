"""idlc's front end over one recorded or invented case, in the words of golden/spec.

A case has `kind`, `pkg`, `name`, `siblings` (path to text), and its text as `text`, or as bytes in
`bytes_hex`; `distro` if that is not Jazzy.
"""

from idlc.compiler import verdicts
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.escapes import through_idl
from idlc.language.parse import parse
from idlc.model import catalog, derive, ir
from idlc.model.distros import BY_NAME
from idlc.model.link import Model, link
from idlc.model.lowering.lower import lower


class Siblings:
    """The other files of a case, before the catalogue."""

    names = staticmethod(catalog.names)
    packages = staticmethod(catalog.packages)
    nearby = staticmethod(catalog.nearby)
    idl_file = staticmethod(catalog.idl_file)
    distro = catalog.distro

    def __init__(self, case):
        self.texts = {}
        for path, text in case.get("siblings", {}).items():
            *folders, file = path.split("/")
            stem, _, kind = file.partition(".")
            package = folders[0] if len(folders) > 1 else case["pkg"]
            self.texts[ir.TypeName(package, kind, stem)] = text

    def source(self, name):
        text = self.texts.get(name)
        return catalog.source(name) if text is None else Source(str(name), text)


def text_of(case):
    """Return the text of a case, `None` for bytes that are no UTF-8."""
    if "bytes_hex" not in case:
        return case["text"]
    try:
        return bytes.fromhex(case["bytes_hex"]).decode("utf-8")
    except UnicodeDecodeError:
        return None


def compile_case(case) -> tuple[Model | None, Report]:
    """Return the model of a case, `None` for bytes that are no UTF-8, and what was reported."""
    report = Report()
    text = text_of(case)
    if text is None:
        return None, report
    name = ir.TypeName(case["pkg"], case["kind"], case["name"])
    source = Source(f"{case['name']}.{case['kind']}", text)
    interface = lower(parse(source), name, report, BY_NAME[case.get("distro", "jazzy")])
    model = link(case["pkg"], [interface], Siblings(case), report)
    verdicts.check(model, report)
    return model, report


def view(case):
    """Return what golden/spec/accept_reject.jsonl records: `build_verdict`, `parsed`, `hash`."""
    model, report = compile_case(case)
    if model is None or report.had_errors:
        return {"build_verdict": "reject"}
    name = ir.TypeName(case["pkg"], case["kind"], case["name"])
    return {
        "build_verdict": "accept",
        "parsed": parsed(model.interfaces[name]),
        "hash": model.describer.hash(str(name)),
    }


def parsed(interface):
    """Return the structures of an interface as rosidl's parser sees them."""
    return [
        {
            "name": message.name.name,
            # rosidl keeps the comments of structures only for messages
            "comment": _comment(message) if isinstance(interface, ir.Message) else [],
            "members": [_member(field) for field in message.wire_fields],
            "constants": [_constant(constant) for constant in message.constants],
        }
        for message in derive.sections(interface)
    ]


def without_repeated_constants(structures):
    """Return recorded structures without constants that rosidl's parser lists twice."""
    for structure in structures:
        constants = structure["constants"]
        structure["constants"] = [c for i, c in enumerate(constants) if c not in constants[:i]]
    return structures


def _comment(described):
    # the .idl file holds one text, which the parser splits again: an empty last line is lost
    return "\n".join(through_idl(line) for line in described.comment).splitlines()


def _member(field):
    record = {"name": field.name, "type": _type(field.type), "comment": _comment(field)}
    if field.default is not None:
        value, text = field.default.value, field.default.text
        as_text = isinstance(value, (str, tuple)) or text in ("inf", "nan")
        record["default"] = text if as_text else value
    if field.unit is not None:
        record["unit"] = through_idl(field.unit)
    return record


def _constant(constant):
    value = constant.value
    if isinstance(value, float) and str(abs(value)) in ("inf", "nan"):
        value = str(abs(value))  # rosidl reads the bare word back as text, the sign is lost
    type_ = constant.type
    if isinstance(type_, ir.String):
        type_ = ir.String(wide=type_.wide, bound=len(value))
    return {
        "name": constant.name,
        "type": _type(type_),
        "value": value,
        "comment": _comment(constant),
    }


def _type(type_):
    if isinstance(type_, ir.Array):
        return f"{_type(type_.element)}[{type_.size}]"
    if isinstance(type_, ir.Sequence):
        bound = "" if type_.bound is None else f", {type_.bound}"
        return f"sequence<{_type(type_.element)}{bound}>"
    if isinstance(type_, ir.String):
        bound = "" if type_.bound is None else f"<{type_.bound}>"
        return f"{'w' * type_.wide}string{bound}"
    return type_.info.idl if isinstance(type_, ir.Primitive) else str(type_.target)
