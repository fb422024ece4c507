"""The pipeline of `idlc docs`: compile packages, write pages about them."""

from __future__ import annotations

from collections.abc import Sequence

from idlc.disk import inputs
from idlc.disk.find import find
from idlc.disk.site import write
from idlc.driver.stages import models_of, stage
from idlc.text.diagnostics import Report


def docs(
    paths: Sequence[str], out: str, package: str | None, include: Sequence[str], report: Report
) -> int:
    """Write a site about the interfaces that paths mean; return how many pages it has."""
    given = inputs.packages(find(paths, report), package, report)
    models = [model for model, _ in models_of(given, include, report)]
    if report.had_errors:
        return 0
    from idlc.emit.site.pages import site

    with stage("document", out):
        files = {file.path: file.text for file in site(models)}
    if not write(out, files, report):
        return 0
    return sum(path.endswith(".html") for path in files)
