"""What is wrong with a user's template, as a problem at its line."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from types import TracebackType

import jinja2

from idlc.diagnostics.codes import BROKEN_TEMPLATE
from idlc.diagnostics.report import Diagnostic
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.suggest import did_you_mean

#: Line ends as Jinja counts them.
_LINE_END = re.compile(r"\r\n|\r|\n")
_DOCUMENTED = "docs/templates.md lists what templates are shown"


class BrokenTemplateError(Exception):
    """A user's template does not give a file."""

    def __init__(self, problem: Diagnostic) -> None:
        super().__init__(problem.message)
        self.problem = problem


def problem(
    error: Exception, name: str, sources: Mapping[str, Source], known: Iterable[str]
) -> Diagnostic:
    """Return what is wrong where a template was rendered.

    `known` are idlc's templates, and the names that templates may use.
    """
    source, line = _place(error, name, sources)
    message, hint = _words(error, [*known, *sources])
    if source is None:
        return BROKEN_TEMPLATE.of(name, message, hint=hint)
    return BROKEN_TEMPLATE.at(_span(source, line, message), message, hint=hint)


def attributes(shown: object) -> set[str]:
    """Return the names that a template may use of what it is shown."""
    inner: list[object]
    if isinstance(shown, Mapping):
        inner, names = list(shown.values()), set(shown)
    elif isinstance(shown, (str, int, float)) or shown is None:
        return set()
    elif type(shown) is tuple:
        inner, names = list(shown), set()
    else:
        fields: tuple[str, ...] = getattr(shown, "_fields", getattr(shown, "__struct_fields__", ()))
        inner = [getattr(shown, field) for field in fields]
        names = {name for name in dir(shown) if not name.startswith("_")} - {"count", "index"}
    return names.union(*map(attributes, inner))


def _words(error: Exception, known: Iterable[str]) -> tuple[str, str | None]:
    """Return what to say of an error, and what to do."""
    match error:
        case jinja2.TemplateNotFound():
            missing = str(error.name)
            return f"there is no template `{missing}`", did_you_mean(missing, known)
        case jinja2.exceptions.SecurityError():
            return _plain(error), "templates run in a sandbox: they can only lay out what is shown"
        case jinja2.UndefinedError():
            message = re.sub(r"'[\w.]*\.(\w+) object' has no", r"`\1` has no", _plain(error))
            quoted = re.search(r"'(\w+)'", message)
            return message, (quoted and did_you_mean(quoted[1], known)) or _DOCUMENTED
        case RecursionError():
            hint = "include the one that it replaces by a name that begins with `idlc/`"
            return "this never ends: the template includes itself, or is nested too deep", hint
    return _plain(error), None


def _plain(error: Exception) -> str:
    text = " ".join(str(error).split()).rstrip(".").replace(". ", "; ")
    return text[:1].lower() + text[1:] if text else f"fails with {type(error).__name__}"


def _place(error: Exception, name: str, sources: Mapping[str, Source]) -> tuple[Source | None, int]:
    """Return the user's template, and the line of it, where an error comes from."""
    if isinstance(error, jinja2.TemplateSyntaxError) and (error.name or "") in sources:
        return sources[error.name or ""], error.lineno
    by_path = {source.path: source for source in sources.values()}
    for path, line in reversed(list(_steps(error.__traceback__))):
        if path in by_path:
            return by_path[path], line
    return sources.get(name), 1


def _steps(traceback: TracebackType | None) -> Iterator[tuple[str, int]]:
    while traceback is not None:
        yield traceback.tb_frame.f_code.co_filename, traceback.tb_lineno
        traceback = traceback.tb_next


def _span(source: Source, line: int, message: str) -> Span:
    """Return the name on a line that a message quotes, or else what stands on the line."""
    ends = [match.span() for match in _LINE_END.finditer(source.text)]
    starts = [0, *(end for _, end in ends)]
    number = min(max(line, 1), len(starts)) - 1
    start = starts[number]
    text = source.text[start : ends[number][0] if number < len(ends) else len(source.text)]
    for quoted in re.findall(r"['`]([^'`]+)['`]", message):
        if place := re.search(rf"(?<!\w){re.escape(quoted)}(?!\w)", text):
            return Span(source, start + place.start(), start + place.end())
    blank = len(text) - len(text.lstrip())
    return Span(source, start + blank, start + max(len(text.rstrip()), blank))


def invalid_output(text: str, name: str, sources: Mapping[str, Source]) -> Diagnostic | None:
    """Return what is wrong with the text that templates gave, if anything."""
    try:
        text.encode("utf-8")
        if name.endswith(".py.jinja"):
            compile(text, name, "exec", dont_inherit=True)
    except UnicodeEncodeError as error:
        wrong = f"U+{ord(text[error.start]):04X}, which UTF-8 cannot hold"
        return BROKEN_TEMPLATE.of(_entry(name, sources), f"what it writes has {wrong}")
    except SyntaxError as error:
        number = error.lineno or 1
        lines = text.splitlines()
        return BROKEN_TEMPLATE.of(
            _entry(name, sources),
            f"what it writes is not valid Python: {error.msg} (line {number})",
            detail=lines[number - 1] if number <= len(lines) else "",
        )
    except (ValueError, MemoryError, RecursionError, OverflowError) as error:
        message = f"what it writes is not valid Python: {_plain(error)}"
        return BROKEN_TEMPLATE.of(_entry(name, sources), message)
    return None


def _entry(name: str, sources: Mapping[str, Source]) -> str:
    """Return the path of the user's template that most likely wrote something."""
    if name in sources:
        return sources[name].path
    folder = name.partition("/")[0]
    near = [source.path for other, source in sources.items() if other.startswith(f"{folder}/")]
    return near[0] if near else name
