"""The pipeline of `idlc docs`: compile packages, write pages about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from idlc.diagnostics.report import Report
from idlc.disk.find import find
from idlc.disk.output.site import write
from idlc.disk.packages import inputs
from idlc.disk.packages.enclosing import manifest, statements
from idlc.disk.scope import Scope
from idlc.driver.generate.gen import is_name, named_packages
from idlc.driver.stages import sound_models, stage

if TYPE_CHECKING:
    from idlc.site.front import About


def docs(paths: Sequence[str], out: str, scope: Scope, report: Report) -> int:
    """Write a site about the interfaces that paths and names mean; return how many pages it has.

    Interfaces with errors, and those that hold them, are left out.
    """
    given = _given(paths, scope, report)
    if report.had_errors:
        return 0
    models = [model for model, _ in sound_models(given, scope, report) if model.own]
    if not models:
        return 0
    from idlc.disk.cache import templates as template_cache
    from idlc.site.pages import site

    about = {one.package: _about(one) for one in given}
    template_cache.keep()
    with stage("document", out):
        files = {file.path: file.text for file in site(models, about)}
    written = Report()
    done = write(out, files, written)
    report.extend(written)
    return sum(path.endswith(".html") for path in files) if done else 0


def _given(words: Sequence[str], scope: Scope, report: Report) -> tuple[inputs.Inputs, ...]:
    names = [word for word in words if is_name(word)]
    known = named_packages(names, scope, report, whole=False)
    paths = [word for word in words if not is_name(word)]
    if not paths or report.had_errors:
        return tuple(known)
    files = find(paths, report, scope.exclude)
    return inputs.without_duplicates((*inputs.packages(files, scope, report), *known), report)


def _about(given: inputs.Inputs) -> About:
    """Return what a package's package.xml says of it."""
    from idlc.site.front import About

    path = manifest(given.folders[0]) if given.folders else None
    found = statements(path, path.as_posix(), Report()) if path else ()
    texts: dict[str, list[str]] = {}
    for one in found:
        texts.setdefault(one.tag, []).append(" ".join(one.text.split()))
    return About(
        version=" ".join(texts.get("version", [])),
        description=" ".join(texts.get("description", [])),
        maintainers=tuple(texts.get("maintainer", [])),
        licenses=tuple(texts.get("license", [])),
    )
