"""Names that ROS 2 refuses: packages, interfaces, and the same name twice (language 2.2)."""

from __future__ import annotations

import keyword
from collections.abc import Iterator

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Label
from idlc.model import derive, ir, names
from idlc.model.link import Model, own_sections


def package_name(model: Model) -> Iterator[Diagnostic]:
    """The package's name is valid; the problem is the package's, so it is reported once."""
    if not names.is_package_name(model.package):
        message = f"`{model.package}` cannot be a package name"
        yield codes.INVALID_PACKAGE_NAME.of(_first_path(model), message, hint=names.PACKAGE_HINT)


def _first_path(model: Model) -> str:
    """Return the file that services show problems of the package in."""
    return ir.path_of(model.own[0]) if model.own and model.own[0].source else model.package


def interface_names(model: Model) -> Iterator[Diagnostic]:
    """File names, and the names derived from them for services and actions, are valid."""
    for interface in model.own:
        if all(names.is_message_name(part.name.name) for part in derive.sections(interface)):
            continue
        name, kind = interface.name.name, interface.name.kind
        like = names.message_name_like(name)
        if kind != "msg" and names.is_message_name(name):
            hint = "this suffix is reserved for the sections of services and actions"
        else:
            hint = f"call it `{like}.{kind}`" if names.is_message_name(like) else names.MESSAGE_HINT
        message = f"`{name}` cannot be the name of a .{kind} file"
        yield codes.INVALID_INTERFACE_NAME.of(ir.path_of(interface), message, hint=hint)


def unique_names(model: Model) -> Iterator[Diagnostic]:
    """No structure has two fields, or two constants, of one name."""
    for message in own_sections(model):
        for noun, code, elements in (
            ("field", codes.DUPLICATE_FIELD, message.fields),
            ("constant", codes.DUPLICATE_CONSTANT, message.constants),
        ):
            first: dict[str, ir.Field | ir.Constant] = {}
            for element in elements:
                earlier = first.setdefault(element.name, element)
                if earlier is not element and earlier.name_span:
                    text = f"duplicate {noun} `{element.name}`"
                    labels = (Label(earlier.name_span, "first definition"),)
                    hint = "rename or remove one of them"
                    yield code.at(element.name_span, text, hint=hint, labels=labels)
        # recorded names may be of any case
        constants = {constant.name for constant in message.constants}
        for field in message.fields:
            if field.name in constants:
                text = f"`{field.name}` is the name of a field and of a constant"
                hint = "rename one of them"
                yield codes.DUPLICATE_FIELD.at(field.name_span, text, hint=hint)


def unique_modules(model: Model) -> Iterator[Diagnostic]:
    """Two interfaces of one kind do not share rosidl's Python module."""
    first: dict[tuple[str, str], ir.TypeName] = {}
    for interface in model.own:
        name = interface.name
        earlier = first.setdefault((name.kind, names.snake_case(name.name)), name)
        if earlier is not name and interface.source:
            yield codes.SAME_PYTHON_MODULE.of(
                ir.path_of(interface),
                f"rosidl puts `{name.name}` and `{earlier.name}` into the same Python module, "
                f"`_{names.snake_case(name.name)}`, and one overwrites the other",
                hint="choose names that differ in more than upper and lower case",
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
_BITS = (8, 16, 32, 64)
_MACROS = frozenset(("NULL", "EOF", "SIZE_MAX")).union(
    (f"INT{bits}_{end}" for bits in _BITS for end in ("MIN", "MAX")),
    (f"UINT{bits}_MAX" for bits in _BITS),
)
_PYTHON_MEMBERS = frozenset({"get_fields_and_field_types", "check_fields"})
_PYTHON_SUFFIXES = ("_Goal", "_Result", "_Feedback")


_NOT_COMPILED = "the code that rosidl generates does not compile"
_RENAME = "rename it if C or C++ code uses this package"


def reserved_field_names(model: Model) -> Iterator[Diagnostic]:
    """Fields are not called like words of Python, C or C++."""
    for message in own_sections(model):
        for field in message.fields:
            name = field.name
            # `builtins` hides the module of that name from the fields after it
            hides_builtins = name == "builtins" and field is not message.fields[-1]
            clash = "a Python keyword" if keyword.iskeyword(name) else ""
            if name in _PYTHON_MEMBERS or hides_builtins:
                clash = "an attribute of the class"
            if clash:
                text = f"`{name}` is {clash}; the Python code that rosidl generates fails"
                hint = "rename it if you build this package with colcon; idlc's Python code works"
                yield codes.BREAKS_ROSIDL_PYTHON.at(field.name_span, text, hint=hint)
            languages = [word for word, names in (("C", _C), ("C++", _CPP)) if name in names]
            if languages:
                code = codes.BREAKS_C if name in _C else codes.BREAKS_CPP
                text = f"`{name}` is reserved in {' and '.join(languages)}; {_NOT_COMPILED}"
                yield code.at(field.name_span, text, hint=_RENAME)


def reserved_constant_names(model: Model) -> Iterator[Diagnostic]:
    """Constants are not called like macros of the C standard library."""
    for message in own_sections(model):
        for constant in message.constants:
            if constant.name in _MACROS:
                text = f"`{constant.name}` is a macro; {_NOT_COMPILED}"
                yield codes.BREAKS_CPP.at(constant.name_span, text, hint=_RENAME)


def reserved_interface_names(model: Model) -> Iterator[Diagnostic]:
    """Messages are not called None, True or False; services do not end in _Goal."""
    for interface in model.own:
        name = interface.name
        if keyword.iskeyword(name.name):
            text = f"`{name.name}` is a Python keyword; the Python code that rosidl generates fails"
            yield codes.BREAKS_ROSIDL_PYTHON.of(ir.path_of(interface), text, hint="rename the file")
        if name.kind == "srv" and name.name.endswith("_Goal"):
            text = f"a service named `{name.name}` breaks the C code that rosidl generates"
            yield codes.BREAKS_C.of(ir.path_of(interface), text, hint="rename the file")


def reserved_package_name(model: Model) -> Iterator[Diagnostic]:
    """The package is not called like a word of Python, C or C++."""
    path = _first_path(model)
    if keyword.iskeyword(model.package):
        text = f"package `{model.package}` is a Python keyword, so Python cannot import it"
        yield codes.BREAKS_ROSIDL_PYTHON.of(path, text, hint="rename the package")
    if model.package in _CPP or model.package == "msg":
        text = f"package `{model.package}` breaks the C++ code that rosidl generates"
        yield codes.BREAKS_CPP.of(path, text, hint="rename the package")


def derived_suffixes(model: Model) -> Iterator[Diagnostic]:
    """Messages whose names look derived are not used as the type of a field."""
    for message in own_sections(model):
        for field, target in message.holders:
            in_python = target.name.endswith(_PYTHON_SUFFIXES)
            if in_python or target.name.endswith("_Request"):
                code = codes.BREAKS_ROSIDL_PYTHON if in_python else codes.BREAKS_C
                languages = "Python and C" if in_python else "C"
                breaks = f"breaks the {languages} code that rosidl generates"
                text = f"a field of type `{target.name}` {breaks}"
                yield code.at(field.type_span, text, hint="rename that message")
