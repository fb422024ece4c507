"""Names that ROS 2 accepts and that then break somebody's code (language 2.3).

The verdict stays "accepted": a warning says who will suffer. idlc's own Python code copes with
all of them.
"""

from __future__ import annotations

import keyword

from idlc.checks.sections import sections
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.model import ir
from idlc.model.link import Model

# C11's keywords and the macros of stdbool.h
_C = frozenset(
    "auto bool break case char const continue default do double else enum extern false float for "
    "goto if inline int long register restrict return short signed sizeof static struct switch "
    "true typedef union unsigned void volatile while".split()
)
# C++17's keywords beside C's; `restrict` is none of them
_CPP = (_C - {"restrict"}) | frozenset(
    "alignas alignof and and_eq asm bitand bitor catch char16_t char32_t class compl const_cast "
    "constexpr decltype delete dynamic_cast explicit export friend mutable namespace new noexcept "
    "not not_eq nullptr operator or or_eq private protected public reinterpret_cast static_assert "
    "static_cast template this thread_local throw try typeid typename using virtual wchar_t xor "
    "xor_eq".split()
)
_MACROS = frozenset(
    {
        "NULL",
        "EOF",
        "SIZE_MAX",
        *(f"INT{bits}_{end}" for bits in (8, 16, 32, 64) for end in ("MIN", "MAX")),
        *(f"UINT{bits}_MAX" for bits in (8, 16, 32, 64)),
    }
)
_PYTHON_MEMBERS = frozenset({"get_fields_and_field_types", "check_fields"})
_PYTHON_SUFFIXES = ("_Goal", "_Result", "_Feedback")


_RENAME = "rename it if C or C++ code may ever use this package"


def field_names(model: Model, report: Report) -> None:
    """Fields are not called like words of Python, C or C++."""
    for message in sections(model):
        for field in message.fields:
            if field.name_span is None:
                continue
            if (what := _python_clash(field, message)) is not None:
                text = f"`{field.name}` is {what}; the Python code that rosidl generates fails"
                hint = "rename it if colcon may ever build this package; idlc's Python copes"
                report.add(codes.BREAKS_ROSIDL_PYTHON.at(field.name_span, text, hint=hint))
            if (native := _native_clash(field.name)) is not None:
                code, text = native
                report.add(code.at(field.name_span, text, hint=_RENAME))


def _python_clash(field: ir.Field, message: ir.Message) -> str | None:
    if keyword.iskeyword(field.name):
        return "a Python keyword"
    # `builtins` hides the module of that name from the fields after it
    hides_builtins = field.name == "builtins" and field is not message.fields[-1]
    if field.name in _PYTHON_MEMBERS or hides_builtins:
        return "used by the class itself"
    return None


def _native_clash(name: str) -> tuple[codes.Code, str] | None:
    if name in _C:
        languages, code = ("C and C++" if name in _CPP else "C"), codes.BREAKS_C
    elif name in _CPP:
        languages, code = "C++", codes.BREAKS_CPP
    else:
        return None
    return code, f"`{name}` is reserved in {languages}; what rosidl generates does not compile"


def constant_names(model: Model, report: Report) -> None:
    """Constants are not called like macros of the C standard library."""
    for message in sections(model):
        for constant in message.constants:
            if constant.name in _MACROS and constant.name_span:
                text = f"`{constant.name}` is a macro; what rosidl generates does not compile"
                report.add(codes.BREAKS_CPP.at(constant.name_span, text, hint=_RENAME))


def interface_names(model: Model, report: Report) -> None:
    """Messages are not called None, True or False; services do not end in _Goal."""
    for interface in model.own:
        name = interface.name
        path = interface.source.path if interface.source else str(name)
        if keyword.iskeyword(name.name):
            text = f"`{name.name}` is a Python keyword; the Python code that rosidl generates fails"
            report.add(codes.BREAKS_ROSIDL_PYTHON.of(path, text, hint="rename the file"))
        if name.kind == "srv" and name.name.endswith("_Goal"):
            text = f"a service called `{name.name}` breaks the C code that rosidl generates"
            report.add(codes.BREAKS_C.of(path, text, hint="rename the file"))


def package_name(model: Model, report: Report) -> None:
    """The package is not called like a word of Python, C or C++."""
    path = model.own[0].source.path if model.own and model.own[0].source else model.package
    if keyword.iskeyword(model.package):
        text = f"package `{model.package}` is a Python keyword; no import statement can name it"
        report.add(codes.BREAKS_ROSIDL_PYTHON.of(path, text, hint="rename the package"))
    if model.package in _CPP or model.package == "msg":
        text = f"package `{model.package}` breaks the C++ code that rosidl generates"
        report.add(codes.BREAKS_CPP.of(path, text, hint="rename the package"))


def derived_suffixes(model: Model, report: Report) -> None:
    """Messages whose names look derived are not used as the type of a field."""
    for message in sections(model):
        for field in message.fields:
            element = ir.element_of(field.type)
            if not isinstance(element, ir.Ref) or field.type_span is None:
                continue
            name = element.target.name
            if name.endswith(_PYTHON_SUFFIXES):
                text = (
                    f"a field of type `{name}` breaks the Python and C code that rosidl generates"
                )
                report.add(
                    codes.BREAKS_ROSIDL_PYTHON.at(field.type_span, text, hint="rename that message")
                )
            elif name.endswith("_Request"):
                text = f"a field of type `{name}` breaks the C code that rosidl generates"
                report.add(codes.BREAKS_C.at(field.type_span, text, hint="rename that message"))
