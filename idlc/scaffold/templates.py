"""The templates of nodes, their tests and packages: idlc's own, and a user's instead of them.

A user's templates run in a sandbox: they came with a repository, perhaps, and must not do more than
write text. Whatever is wrong with one is a problem at a line of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import cache

import jinja2
from jinja2.exceptions import SecurityError
from jinja2.sandbox import ImmutableSandboxedEnvironment

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.suggest import did_you_mean
from idlc.scaffold.template_problems import (
    BrokenTemplateError,
    attributes,
    invalid_output,
    problem,
)
from idlc.templating import environment

#: The version of what templates are shown; it grows when an attribute changes or goes.
VERSION = 1
#: Folders of templates that a user can replace.
FOLDERS = ("node", "node_test", "package")
ENDING = ".jinja"
#: By a name that begins so a user's template includes idlc's, even the one that it replaces.
OWN = "idlc/"
_DECLARED = re.compile(r"\s*\{#-?\s*idlc templates (\d{1,9})\b")
_HEAD = f"{{# idlc templates {VERSION} (see docs/templates.md) #}}\n"


@cache
def names() -> tuple[str, ...]:
    """Return the templates that a user can replace."""
    return tuple(name for name in _all() if name.partition("/")[0] in FOLDERS)


def folders() -> tuple[str, ...]:
    """Return the folders of all templates, also of those that nobody can replace."""
    return tuple(sorted({name.partition("/")[0] for name in _all()}))


@cache
def _all() -> tuple[str, ...]:
    found = environment().list_templates(extensions=[ENDING.removeprefix(".")])
    return tuple(sorted(found))


def copy(name: str) -> str:
    """Return the text of one of idlc's templates, to be changed by a user."""
    return _HEAD + _own_source(name)[0]


def _own_source(name: str) -> tuple[str, str | None]:
    own = environment()
    assert own.loader is not None
    text, file, _ = own.loader.get_source(own, name)
    return text, file


class _Loader(jinja2.BaseLoader):
    """Gives a user's templates by their names, and idlc's where there is none of the user's."""

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
    """Refuses what is unsafe at once, by its own name."""

    def unsafe_undefined(self, obj: object, attribute: str) -> jinja2.Undefined:  # noqa: ARG002
        """Refuse an attribute of Python's own."""
        raise SecurityError(f"attribute {attribute!r} is not for templates")


class Templates:
    """The templates of one run. `sources` are the user's, by their names."""

    def __init__(self, sources: Mapping[str, Source] | None = None) -> None:
        self._sources = sources or {}
        self._environment = _sandbox(self._sources) if sources else environment()

    def render(self, name: str, **shown: object) -> str:
        """Return what a template makes of what it is shown.

        Raises BrokenTemplateError if one of the user's templates is wrong; idlc's own are not.
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
        """Report what is wrong with the user's templates before any is used."""
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
    same = [one for one in names() if one.rpartition("/")[2].split(".")[0] == file]
    if same:
        return f"did you mean {' or '.join(f'`{one}`' for one in same[:2])}?"
    return did_you_mean(name, names())


def _sandbox(sources: Mapping[str, Source]) -> jinja2.Environment:
    """Return an environment that lays out as idlc's own does, and runs nothing."""
    own = environment()
    return _Sandbox(
        loader=_Loader(sources),
        undefined=own.undefined,
        autoescape=own.autoescape,
        trim_blocks=own.trim_blocks,
        lstrip_blocks=own.lstrip_blocks,
        keep_trailing_newline=own.keep_trailing_newline,
    )
