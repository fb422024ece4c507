"""Names that ROS 2 refuses: packages, interfaces, and the same name twice (language 2.2)."""

from __future__ import annotations

import keyword

from idlc.diagnostics import codes
from idlc.diagnostics.report import Label, Report
from idlc.model import derive, ir, names
from idlc.model.link import Model, own_sections


def package_name(model: Model, report: Report) -> None:
    """The package's name is valid; the problem is the package's, so it is reported once."""
    if not names.is_package_name(model.package):
        where = model.own[0].source if model.own else None
        report.add(
            codes.INVALID_PACKAGE_NAME.of(
                where.path if where else model.package,
                f"`{model.package}` cannot be a package name",
                hint=names.PACKAGE_HINT,
            )
        )


def interface_names(model: Model, report: Report) -> None:
    """File names, and the names derived from them for services and actions, are valid."""
    for interface in model.own:
        if all(names.is_message_name(part.name.name) for part in derive.sections(interface)):
            continue
        name, kind = interface.name.name, interface.name.kind
        like = names.message_name_like(name)
        if kind != "msg" and names.is_message_name(name):
            hint = "this ending is kept for the parts of services and actions"
        else:
            hint = f"call it `{like}.{kind}`" if names.is_message_name(like) else names.MESSAGE_HINT
        report.add(
            codes.INVALID_INTERFACE_NAME.of(
                interface.source.path if interface.source else str(interface.name),
                f"`{name}` cannot be the name of a .{kind} file",
                hint=hint,
            )
        )


def unique_fields(model: Model, report: Report) -> None:
    """No structure has two fields of one name."""
    for message in own_sections(model):
        first: dict[str, ir.Field] = {}
        for field in message.fields:
            earlier = first.setdefault(field.name, field)
            if earlier is not field and field.name_span and earlier.name_span:
                report.add(
                    codes.DUPLICATE_FIELD.at(
                        field.name_span,
                        f"a second field `{field.name}`",
                        labels=(Label(earlier.name_span, "the first is here"),),
                        hint="rename or remove one of them",
                    )
                )


def unique_constants(model: Model, report: Report) -> None:
    """No structure has two constants of one name."""
    for message in own_sections(model):
        first: dict[str, ir.Constant] = {}
        for constant in message.constants:
            earlier = first.setdefault(constant.name, constant)
            if earlier is not constant and constant.name_span and earlier.name_span:
                report.add(
                    codes.DUPLICATE_CONSTANT.at(
                        constant.name_span,
                        f"a second constant `{constant.name}`",
                        labels=(Label(earlier.name_span, "the first is here"),),
                        hint="rename or remove one of them",
                    )
                )


def unique_modules(model: Model, report: Report) -> None:
    """Two interfaces of one kind do not share rosidl's Python module."""
    first: dict[tuple[str, str], ir.TypeName] = {}
    for interface in model.own:
        name = interface.name
        earlier = first.setdefault((name.kind, names.snake_case(name.name)), name)
        if earlier is not name and interface.source:
            report.add(
                codes.SAME_PYTHON_MODULE.of(
                    interface.source.path,
                    f"rosidl puts `{name.name}` and `{earlier.name}` into one Python module, "
                    f"`_{names.snake_case(name.name)}`, where one of them is lost",
                    hint="give them names that differ in more than capitals",
                )
            )


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


def reserved_field_names(model: Model, report: Report) -> None:
    """Fields are not called like words of Python, C or C++."""
    for message in own_sections(model):
        for field in message.fields:
            if field.name_span is None:
                continue
            if (clash := _python_clash(field, message)) is not None:
                text = f"`{field.name}` is {clash}; the Python code that rosidl generates fails"
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


def reserved_constant_names(model: Model, report: Report) -> None:
    """Constants are not called like macros of the C standard library."""
    for message in own_sections(model):
        for constant in message.constants:
            if constant.name in _MACROS and constant.name_span:
                text = f"`{constant.name}` is a macro; what rosidl generates does not compile"
                report.add(codes.BREAKS_CPP.at(constant.name_span, text, hint=_RENAME))


def reserved_interface_names(model: Model, report: Report) -> None:
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


def reserved_package_name(model: Model, report: Report) -> None:
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
    for message in own_sections(model):
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
