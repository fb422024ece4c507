"""The rules that every command asks: functions that yield the problems of a model."""

from __future__ import annotations

import keyword
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from typing import TypeAlias

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Label, Report
from idlc.diagnostics.source import Span
from idlc.language.escapes import plain_meaning
from idlc.model import derive, ir, names
from idlc.model.link import Model, dependents, own_sections
from idlc.model.lowering import lower_types
from idlc.model.lowering.lower_values import BACKSLASH_HINT, FLOAT32_MAX

Rule: TypeAlias = Callable[[Model], Iterable[Diagnostic]]
Findings: TypeAlias = dict[ir.TypeName, tuple[Diagnostic, ...]]


class IncrementalFindings:
    """The findings of earlier runs, kept for interfaces that did not change since.

    An interface has changed if it, or any interface that it refers to, is another object.
    """

    def __init__(self) -> None:
        self._packages: dict[str, tuple[dict[ir.TypeName, ir.Interface | None], Findings]] = {}

    def still_valid(self, model: Model) -> Findings:
        """Return the findings of a package's unchanged interfaces; the caller adds the others."""
        graph = model.graph()
        before, findings = self._packages.get(model.package, ({}, {}))
        now = {name: interface for name, (interface, _) in graph.items()}
        new = [name for name in now if name not in before or before[name] is not now[name]]
        changed = dependents(new, ((name, targets) for name, (_, targets) in graph.items()))
        own = (interface.name for interface in model.own)
        kept = {name: findings[name] for name in own if name in findings and name not in changed}
        self._packages[model.package] = now, kept
        return kept


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


def constants_and_defaults(model: Model) -> Iterator[Diagnostic]:
    """Values reach every language as they are written."""
    for message in own_sections(model):
        for constant in message.constants:
            if constant.value_span is not None:
                yield from _problems(constant.value, constant.type, constant.value_span)
        for field in message.fields:
            if field.default is not None and field.default_span is not None:
                yield from _problems(field.default.value, field.type, field.default_span)


def _problems(value: ir.Value, type_: ir.FieldType, span: Span) -> Iterator[Diagnostic]:
    element = ir.element_of(type_)
    texts = value if isinstance(value, tuple) else (value,)
    if value == () and isinstance(element, ir.Primitive) and element.name not in ("bool", "byte"):
        yield _breaks_python(span, "an empty default for a numeric sequence")
    if any(isinstance(text, str) and set(text) & set("\n\r\0") for text in texts):
        yield _breaks_python(span, "a line break or NUL in a value")
    if isinstance(value, str):
        yield from _text_problems(value, span)
    elif not isinstance(value, float):
        return
    elif not math.isfinite(value):
        message = (
            f"`{span.text}` is not finite; the code that rosidl generates for it does not compile"
        )
        hint = "use a large finite number, or set the value in code"
        yield codes.NON_FINITE_VALUE.at(span, message, hint=hint)
    elif element == ir.Primitive("float32") and abs(value) > FLOAT32_MAX:
        message = f"`{span.text}` exceeds the range of float32"
        yield codes.FLOAT32_RANGE.at(span, message, hint="use float64")


def _text_problems(value: str, span: Span) -> Iterator[Diagnostic]:
    """Yield the problems of a text that ROS 2 reads otherwise, or with more than is meant."""
    text = span.text
    is_closed = len(text) > 1 and text[0] == text[-1]
    content = text[1:-1] if is_closed and text[0] in "\"'" else text
    if "\\" in content and value != plain_meaning(content):
        message = f"ROS 2 interprets the backslashes more than once and reads {value!r}"
        yield codes.MANGLED_TEXT.at(span, message, hint=BACKSLASH_HINT)
    line, column = span.source.position(span.end)
    one_sided = text[:1] in ('"', "'") and not is_closed
    if lower_types.has_comment(text) and (one_sided or lower_types.is_comment(text)):
        message = "ROS 2 reads this comment as part of the text"
        yield codes.ODD_TEXT.at(span, message, hint=lower_types.COMMENT_HINT)
    # or a `#` is to blame, see IDL109
    elif one_sided and text[0] not in span.source.line_text(line)[column - 1 :]:
        message = f"no closing {text[0]}, so the opening quote is part of the text"
        yield codes.ODD_TEXT.at(span, message, hint="close the quotes, or remove them")


def _breaks_python(span: Span, subject: str) -> Diagnostic:
    message = f"{subject} breaks the Python code that rosidl generates"
    return codes.BREAKS_ROSIDL_PYTHON.at(
        span, message, hint="remove the default, and set the value in code"
    )


#: Rules that every command asks, the most helpful messages first; of the whole package, then
#: of each interface with its references.
_OF_PACKAGES = (
    package_name,
    unique_modules,
    reserved_package_name,
)
_VERDICTS = (
    interface_names,
    unique_names,
    reserved_field_names,
    reserved_constant_names,
    reserved_interface_names,
    derived_suffixes,
    constants_and_defaults,
)


def check(model: Model, report: Report, incremental: IncrementalFindings | None = None) -> None:
    """Report the problems that every command reports in the model's own interfaces."""
    for rule in _OF_PACKAGES:
        report.extend(rule(model))
    report.extend(findings(_VERDICTS, model, incremental))


def findings(
    rules: Sequence[Rule], model: Model, incremental: IncrementalFindings | None
) -> Iterator[Diagnostic]:
    """Yield the findings of rules; with `incremental`, only changed interfaces are looked at."""
    if incremental is None:
        yield from chain.from_iterable(rule(model) for rule in rules)
        return
    findings = incremental.still_valid(model)
    for interface in model.own:
        if interface.name not in findings:
            alone = model.alone(interface)
            findings[interface.name] = tuple(chain.from_iterable(rule(alone) for rule in rules))
        yield from findings[interface.name]
