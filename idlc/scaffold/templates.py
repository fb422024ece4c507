"""The templates of nodes, their tests and packages: idlc's own, and a user's that replace them.

A user's templates run in a sandbox: they may come with a repository, and must only write text.
Each problem of a template is reported at its line.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from types import TracebackType

import jinja2
from jinja2.exceptions import SecurityError
from jinja2.sandbox import ImmutableSandboxedEnvironment

from idlc.diagnostics import codes
from idlc.diagnostics.codes import BROKEN_TEMPLATE
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import did_you_mean
from idlc.project.files import is_folder, read_source
from idlc.project.root import Root
from idlc.project.templates import environment

#: Line ends as Jinja counts them.
_LINE_END = re.compile(r"\r\n|\r|\n")
_DOCUMENTED = "docs/templates.md lists what templates are shown"


class BrokenTemplateError(Exception):
    """A user's template cannot be rendered to a file."""

    def __init__(self, problem: Diagnostic) -> None:
        super().__init__(problem.message)
        self.problem = problem


def problem(
    error: Exception, name: str, sources: Mapping[str, Source], allowed: Iterable[str]
) -> Diagnostic:
    """Return the problem of a template that could not be rendered.

    `allowed` are idlc's templates, and the names that templates may use.
    """
    source, line = _place(error, name, sources)
    message, hint = _words(error, [*allowed, *sources])
    if source is None:
        return BROKEN_TEMPLATE.of(name, message, hint=hint)
    return BROKEN_TEMPLATE.at(_span(source, line, message), message, hint=hint)


def attributes(shown: object) -> set[str]:
    """Return the names that a template may use in the values it gets."""
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


def _words(error: Exception, allowed: Iterable[str]) -> tuple[str, str | None]:
    """Return the message for an error, and a hint."""
    match error:
        case jinja2.TemplateNotFound():
            missing = str(error.name)
            return f"there is no template `{missing}`", did_you_mean(missing, allowed)
        case jinja2.exceptions.SecurityError():
            return _plain(error), "templates run in a sandbox: they can only lay out what is shown"
        case jinja2.UndefinedError():
            message = re.sub(r"'[\w.]*\.(\w+) object' has no", r"`\1` has no", _plain(error))
            quoted = re.search(r"'(\w+)'", message)
            return message, (quoted and did_you_mean(quoted[1], allowed)) or _DOCUMENTED
        case RecursionError():
            hint = "include the one that it replaces by a name that begins with `idlc/`"
            return "this never ends: the template includes itself, or is nested too deep", hint
    return _plain(error), None


def _plain(error: Exception) -> str:
    text = " ".join(str(error).split()).rstrip(".").replace(". ", "; ")
    return text[:1].lower() + text[1:] if text else f"fails with {type(error).__name__}"


def _place(error: Exception, name: str, sources: Mapping[str, Source]) -> tuple[Source | None, int]:
    """Return the user's template and the line that an error comes from."""
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
    """Return the span of the name that a message quotes on a line, or else of the line's text."""
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
    """Return the problem of a rendered text, if it has one."""
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
    """Return the path of the user's template that most likely wrote a file."""
    if name in sources:
        return sources[name].path
    folder = name.partition("/")[0]
    near = [source.path for other, source in sources.items() if other.startswith(f"{folder}/")]
    return near[0] if near else name


#: The version of the values for templates; it grows when an attribute changes or goes.
VERSION = 1
#: Folders of templates that a user can replace.
FOLDERS = ("node", "package")
ENDING = ".jinja"
#: The prefix by which a user's template includes one of idlc's, even the one that it replaces.
OWN = "idlc/"
_DECLARED = re.compile(r"\s*\{#-?\s*idlc templates (\d{1,9})\b")
_HEAD = f"{{# idlc templates {VERSION} (see docs/templates.md) #}}\n"


@cache
def names() -> tuple[str, ...]:
    """Return the templates that a user can replace."""
    return tuple(name for name in _all() if name.partition("/")[0] in FOLDERS)


def folders() -> tuple[str, ...]:
    """Return the folders of all templates, also of those that users cannot replace."""
    return tuple(sorted({name.partition("/")[0] for name in _all()}))


@cache
def _all() -> tuple[str, ...]:
    templates = environment().list_templates(extensions=[ENDING.removeprefix(".")])
    return tuple(sorted(templates))


def copy(name: str) -> str:
    """Return the text of one of idlc's templates, to be changed by a user."""
    return _HEAD + _own_source(name)[0]


def _own_source(name: str) -> tuple[str, str | None]:
    own = environment()
    assert own.loader is not None
    text, file, _ = own.loader.get_source(own, name)
    return text, file


class _Loader(jinja2.BaseLoader):
    """Loads a user's templates by their names, and idlc's for all others."""

    def __init__(self, sources: Mapping[str, Source]) -> None:
        self._sources = sources

    def get_source(
        self,
        environment: jinja2.Environment,  # noqa: ARG002 - the signature of loaders
        template: str,
    ) -> tuple[str, str | None, Callable[[], bool] | None]:
        """Return a template's text and the path by which tracebacks name it."""
        source = self._sources.get(template)
        own = template.removeprefix(OWN)
        text, path = (source.text, source.path) if source else _own_source(own)
        return text, path, lambda: True


class _Sandbox(ImmutableSandboxedEnvironment):
    """Refuses unsafe attributes at once, by their names."""

    def unsafe_undefined(self, obj: object, attribute: str) -> jinja2.Undefined:  # noqa: ARG002
        """Refuse an attribute of Python's own."""
        raise SecurityError(f"attribute {attribute!r} is not for templates")


class Templates:
    """The templates of one run. `sources` are the user's, by their names."""

    def __init__(self, sources: Mapping[str, Source] | None = None) -> None:
        self._sources = sources or {}
        self._environment = _sandbox(self._sources) if sources else environment()

    def render(self, name: str, **shown: object) -> str:
        """Return the text that a template renders.

        Raises BrokenTemplateError for errors in the user's templates.
        """
        if not self._sources:
            return self._environment.get_template(name).render(shown)
        try:
            text = self._environment.get_template(name).render(shown)
        except Exception as error:
            raise BrokenTemplateError(self._problem(error, name, shown)) from error
        wrong = invalid_output(text, name, self._sources)
        if wrong:
            raise BrokenTemplateError(wrong)
        return text

    def check(self, report: Report) -> None:
        """Report problems of the user's templates before any is used."""
        for name, source in self._sources.items():
            if not _is_known(name):
                report.add(_unknown(name, source))
                continue
            declared = _DECLARED.match(source.text)
            if declared and declared[1] != str(VERSION):
                message = f"this was written for version {declared[1]} of templates, not {VERSION}"
                hint = f"copy it again with `idlc scaffold templates --copy {name}`"
                span = Span(source, *declared.span(1))
                report.add(codes.BROKEN_TEMPLATE.at(span, message, hint=hint))
                continue
            try:
                self._environment.get_template(name)
            except Exception as error:
                report.add(self._problem(error, name, {}))

    def _problem(self, error: Exception, name: str, shown: Mapping[str, object]) -> Diagnostic:
        return problem(error, name, self._sources, (*_all(), *attributes(shown)))


def _is_known(name: str) -> bool:
    folder, _, file = name.rpartition("/")
    return name in names() or (folder in ("", *FOLDERS) and file.startswith("_"))


def _unknown(name: str, source: Source) -> Diagnostic:
    """Return the problem with a template that idlc would never use."""
    if name in _all():
        message = f"`{name}` cannot be replaced: it is not of a node, a test or a package"
        return codes.BROKEN_TEMPLATE.of(source.path, message, hint="remove the file")
    hint = suggestion(name) or "begin its name with `_` if only other templates include it"
    return codes.BROKEN_TEMPLATE.of(source.path, f"there is no template `{name}`", hint=hint)


def suggestion(name: str) -> str | None:
    """Return the hint for a name that no template has."""
    file = name.rpartition("/")[2].split(".")[0]
    same = [other for other in names() if other.rpartition("/")[2].split(".")[0] == file]
    if same:
        return f"did you mean {' or '.join(f'`{other}`' for other in same[:2])}?"
    return did_you_mean(name, names())


def _sandbox(sources: Mapping[str, Source]) -> jinja2.Environment:
    """Return a sandboxed environment with the settings of idlc's own."""
    own = environment()
    return _Sandbox(
        loader=_Loader(sources),
        undefined=own.undefined,
        autoescape=own.autoescape,
        trim_blocks=own.trim_blocks,
        lstrip_blocks=own.lstrip_blocks,
        keep_trailing_newline=own.keep_trailing_newline,
    )


def read(
    folder: str, below: Iterable[str], ending: str, root: Root, report: Report
) -> dict[str, Source]:
    """Return the files with an ending in a folder and in some folders of it, by `folder/name`.

    Files that cannot be read are reported.
    """
    path = root.absolute(folder)
    if not is_folder(path):
        message = f"no such folder: `{folder}`, which is to hold templates"
        hint = "`idlc scaffold templates --copy NAME` starts one"
        report.add(codes.NO_SUCH_PATH.of(folder, message, hint=hint))
        return {}
    sources = {}
    for prefix in ("", *(f"{subfolder}/" for subfolder in sorted(below))):
        for file in _files(path / prefix, ending):
            name = f"{prefix}{file.name}"
            source = read_source(file, f"{folder}/{name}", report)
            if source is not None:
                sources[name] = source
    return sources


def _files(folder: Path, ending: str) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if path.name.endswith(ending))
    except OSError:
        return []
