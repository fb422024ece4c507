"""The templates of nodes and packages: idlc's own, and a user's that replace them by name.

A user's templates run in a sandbox: they may come with a repository, and must only write text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from traceback import walk_tb
from typing import cast

import jinja2
from jinja2.exceptions import SecurityError
from jinja2.sandbox import ImmutableSandboxedEnvironment

from idlc.diagnostics.codes import BROKEN_TEMPLATE, NO_SUCH_PATH
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import did_you_mean
from idlc.project.files import is_folder, read_source
from idlc.project.root import Root
from idlc.project.templates import code, place_only_code

#: Folders of templates that a user can replace.
FOLDERS = ("node", "package")
ENDING = ".jinja"


@cache
def names() -> tuple[str, ...]:
    """Return the templates that a user can replace."""
    own = code().list_templates(extensions=[ENDING.removeprefix(".")])
    return tuple(sorted(name for name in own if name.partition("/")[0] in FOLDERS))


class BrokenTemplateError(Exception):
    """A user's template cannot be rendered to a file."""

    def __init__(self, problem: Diagnostic) -> None:
        super().__init__(problem.message)
        self.problem = problem


class _Sandbox(ImmutableSandboxedEnvironment):
    """Refuses unsafe attributes at once, by their names."""

    def unsafe_undefined(self, obj: object, attribute: str) -> jinja2.Undefined:  # noqa: ARG002
        """Refuse an attribute of Python's own."""
        raise SecurityError(f"templates cannot use the attribute {attribute!r}")


class Templates:
    """The templates of one run. `sources` are the user's, by their names."""

    def __init__(self, sources: Mapping[str, Source] | None = None) -> None:
        self._sources = sources or {}
        self._environment = _sandbox(self._sources) if sources else code()

    def render(self, name: str, **shown: object) -> str:
        """Return the text that a template renders.

        Raises BrokenTemplateError for errors in the user's templates.
        """
        if not self._sources:
            return self._environment.get_template(name).render(shown)
        try:
            text = self._environment.get_template(name).render(shown)
            if name.endswith(".py.jinja"):
                compile(text, name, "exec", dont_inherit=True)
        except Exception as error:
            raise BrokenTemplateError(self._problem(error, name, shown)) from error
        return text

    def check(self, report: Report) -> None:
        """Report problems of the user's templates before any is used."""
        for name, source in self._sources.items():
            if name not in names() and not name.rpartition("/")[2].startswith("_"):
                message = f"idlc has no template `{name}` to replace"
                hint = "begin its name with `_` if only other templates include it"
                if name in code().list_templates():
                    hint = f"remove it: you can only replace templates in {'/ and '.join(FOLDERS)}/"
                hint = suggestion(name) or hint
                report.add(BROKEN_TEMPLATE.of(source.path, message, hint=hint))
                continue
            try:
                self._environment.get_template(name)
            except Exception as error:
                report.add(self._problem(error, name, {}))

    def _problem(self, error: Exception, name: str, shown: Mapping[str, object]) -> Diagnostic:
        """Return the problem of a template that could not be rendered, at the user's line."""
        by_path = {source.path: source for source in self._sources.values()}
        steps = ((frame.f_code.co_filename, line) for frame, line in walk_tb(error.__traceback__))
        places = [(by_path[path], line) for path, line in steps if path in by_path]
        if isinstance(error, jinja2.TemplateSyntaxError) and (error.name or "") in self._sources:
            places = [(self._sources[error.name or ""], error.lineno)]
        hint = _hint(error, shown, self._sources)
        if places:
            return BROKEN_TEMPLATE.at(_line(*places[-1]), _message(error), hint=hint)
        folder = name.partition("/")[0]
        near = [source for key, source in self._sources.items() if key.startswith(f"{folder}/")]
        replaced = self._sources.get(name) or next(iter([*near, *self._sources.values()]))
        detail = (error.text or "").rstrip() if isinstance(error, SyntaxError) else ""
        return BROKEN_TEMPLATE.of(replaced.path, _message(error), hint=hint, detail=detail)


def _message(error: Exception) -> str:
    match error:
        case jinja2.TemplateNotFound():
            return f"no such template: `{error.name}`"
        case RecursionError():
            return "the template includes itself, or is nested too deeply"
        case SyntaxError():
            return f"the template renders invalid Python: {error.msg} (line {error.lineno})"
    text = " ".join(str(error).split()).rstrip(".").replace(". ", "; ")
    text = re.sub(r"'[\w.]*\.(\w+) object' has no", r"`\1` has no", text)
    return text[:1].lower() + text[1:] if text else f"fails with {type(error).__name__}"


def _hint(error: Exception, shown: Mapping[str, object], own: Iterable[str]) -> str | None:
    match error:
        case jinja2.TemplateNotFound():
            return suggestion(str(error.name), own)
        case SecurityError():
            return "templates run in a sandbox, and can render only values that idlc passes to them"
        case jinja2.UndefinedError():
            quoted = re.search(r"'(\w+)'(?: is undefined)?$", str(error))
            near = quoted and did_you_mean(quoted[1], {*_attributes(shown)})
            return near or "docs/templates.md lists the values that idlc passes to templates"
        case RecursionError():
            return "remove the include of the template itself"
    return None


def _attributes(value: object) -> Iterator[str]:
    """Yield the names by which a template can use a value, and what the value holds."""
    inner: Iterable[object] = ()
    if isinstance(value, Mapping):
        yield from value
        inner = value.values()
    elif type(value) in (tuple, list):
        inner = cast(Iterable[object], value)
    elif not isinstance(value, (str, int, float)):
        yield from (name for name in dir(value) if not name.startswith("_"))
        fields = getattr(value, "_fields", getattr(value, "__struct_fields__", ()))
        inner = (getattr(value, field) for field in fields)
    for each in inner:
        yield from _attributes(each)


def suggestion(name: str, own: Iterable[str] = ()) -> str | None:
    """Return the hint for a name that no template has; `own` are the user's."""
    known, file = [*names(), *own], name.rpartition("/")[2]
    same = next((each for each in known if each.endswith(f"/{file}")), None)
    return f"did you mean `{same}`?" if same else did_you_mean(name, known)


def _line(source: Source, number: int) -> Span:
    """Return the span of the text on a line."""
    lines = re.split(r"(\r\n|\r|\n)", source.text)  # as Jinja counts them
    number = min(max(number, 1), len(lines) // 2 + 1)
    start = len("".join(lines[: 2 * number - 2]))
    text = lines[2 * number - 2]
    blank = len(text) - len(text.lstrip())
    return Span(source, start + blank, start + max(len(text.rstrip()), blank))


def _sandbox(sources: Mapping[str, Source]) -> jinja2.Environment:
    """Return a sandboxed environment with the settings of idlc's own."""

    def load(name: str) -> tuple[str, str, None] | None:
        source = sources.get(name)
        return (source.text, source.path, None) if source else None  # tracebacks name the path

    own = code()
    assert own.loader is not None
    environment = _Sandbox(
        loader=jinja2.ChoiceLoader([jinja2.FunctionLoader(load), own.loader]),
        undefined=own.undefined,
        trim_blocks=own.trim_blocks,
        lstrip_blocks=own.lstrip_blocks,
        keep_trailing_newline=own.keep_trailing_newline,
    )
    return place_only_code(environment)


def read(folder: str, root: Root, report: Report) -> dict[str, Source]:
    """Return the templates in a user's folder by their names; report those that cannot be read."""
    path = root.absolute(folder)
    if not is_folder(path):
        message = f"no such folder for templates: `{folder}`"
        hint = "`idlc scaffold templates --copy NAME` creates one"
        report.add(NO_SUCH_PATH.of(folder, message, hint=hint))
        return {}
    sources = {}
    for file in sorted([*path.glob(f"*{ENDING}"), *path.glob(f"*/*{ENDING}")]):
        name = file.relative_to(path).as_posix()
        source = read_source(file, f"{folder}/{name}", report)
        if source is not None:
            sources[name] = source
    return sources
