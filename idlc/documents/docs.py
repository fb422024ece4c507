"""The pipeline of `idlc docs`: compile packages, write pages about them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from idlc.check.compiler import sound_models, stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.generate.gen import is_name, named_packages
from idlc.project import inputs
from idlc.project.atomic import alone
from idlc.project.find import find
from idlc.project.lock import Obstacle, Tree, digest, is_same, may_be_own
from idlc.project.package_xml import read_statements
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.project.write import Change, Plan, apply_changes, journals, sweep

if TYPE_CHECKING:
    from idlc.documents.pages import About

#: The pages that a run wrote, each with its SHA-256.
LISTING = "idlc-docs.json"


def write(out: str, files: Mapping[str, str], root: Root, report: Report) -> bool:
    """Write files below `out`; report IDL612 to IDL614 and return `False` if that is refused."""
    folder = root.absolute(out)
    with alone(folder):
        return _write(folder, out, files, report)


def _write(folder: Path, out: str, files: Mapping[str, str], report: Report) -> bool:
    tree = Tree(folder)
    mine = _listed(folder, tree)
    pages = {path: text.encode("utf-8") for path, text in files.items()}
    listed = {path: digest(data) for path, data in sorted(pages.items())}
    listing = json.dumps(listed, indent=1).encode() + b"\n"
    changes: list[Change] = []
    stale = {path for path, _ in mine} - pages.keys()
    renamed = tree.renamed(stale, pages)
    mine |= {(renamed[path], sha256) for path, sha256 in mine if path in renamed}
    for path in (*pages, *sorted(stale - renamed.keys())):
        old, new = tree.read(path), pages.get(path)
        foreign = isinstance(old, Obstacle) or (
            old is not None and not is_same(old, new) and (path, digest(old)) not in mine
        )
        if foreign and new is not None:
            report.add(_in_the_way(f"{out}/{path}", old))
        elif not foreign and not isinstance(old, Obstacle) and not is_same(old, new):
            changes.append(Change(path, old, new))
    record = tree.read(LISTING)
    if isinstance(record, Obstacle):
        report.add(_in_the_way(f"{out}/{LISTING}", record))
    elif record != listing:
        changes.append(Change(LISTING, record, listing))
    if report.had_errors:
        return False
    if not changes:
        sweep(folder)
    return apply_changes(Plan(folder, tuple(changes), {}), out, report, listing)


def _in_the_way(shown: str, current: Obstacle | bytes | None) -> Diagnostic:
    message = f"`{shown}` was not written by idlc, or edited since"
    if isinstance(current, Obstacle):
        message = f"cannot write `{shown}`: {current.what}"
    return codes.FOREIGN_FILE.of(
        shown, message, hint="move it away, or choose another folder with -o"
    )


def _listed(folder: Path, tree: Tree) -> set[tuple[str, str]]:
    """Return the pages that earlier runs may have written, each with its SHA-256."""
    record = tree.read(LISTING)
    written: set[tuple[str, str]] = set()
    for data in (record if isinstance(record, bytes) else b"", *journals(folder)):
        try:
            listed = json.loads(data)
        except (ValueError, RecursionError):
            continue
        if isinstance(listed, dict):
            written |= {
                (path, sha256)
                for path, sha256 in listed.items()
                if may_be_own(path) and isinstance(sha256, str)
            }
    return written


def docs(paths: Sequence[str], out: str, scope: Scope, report: Report) -> int:
    """Write a site about the interfaces of paths and names; return its number of pages.

    Interfaces with errors, and interfaces that hold these, are left out.
    """
    packages = _packages(paths, scope, report)
    if report.had_errors:
        return 0
    models = [model for model, _ in sound_models(packages, scope, report) if model.own]
    if not models:
        return 0
    from idlc.documents.pages import site
    from idlc.project import templates

    about = {package.package: _about(package, scope.root) for package in packages}
    templates.keep()
    with stage("document", out):
        files = {file.path: file.text for file in site(models, about)}
    written = Report()
    done = write(out, files, scope.root, written)
    report.extend(written)
    return sum(path.endswith(".html") for path in files) if done else 0


def _packages(words: Sequence[str], scope: Scope, report: Report) -> tuple[inputs.Inputs, ...]:
    names = [word for word in words if is_name(word, scope.root)]
    named = named_packages(names, scope, report, whole=False)
    paths = [word for word in words if not is_name(word, scope.root)]
    if not paths or report.had_errors:
        return tuple(named)
    files = find(paths, scope.root, report, scope.exclude)
    packages = (*inputs.packages(files, scope, report), *named)
    return inputs.without_duplicates(packages, scope.root, report)


def _about(package: inputs.Inputs, root: Root) -> About:
    """Return the facts about a package in its package.xml."""
    from idlc.documents.pages import About

    path = root.manifest(package.folders[0]) if package.folders else None
    statements = read_statements(path, path.as_posix(), root, Report()) if path else ()
    texts: dict[str, list[str]] = {}
    for statement in statements:
        texts.setdefault(statement.tag, []).append(" ".join(statement.text.split()))
    return About(
        version=" ".join(texts.get("version", [])),
        description=" ".join(texts.get("description", [])),
        maintainers=tuple(texts.get("maintainer", [])),
        licenses=tuple(texts.get("license", [])),
    )
