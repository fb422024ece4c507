"""Writing a site: all of it or nothing, and only files that an earlier run wrote are touched."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.disk.output.folder_lock import alone
from idlc.disk.output.lock_file import digest, is_same
from idlc.disk.output.transaction import apply_changes, journals, sweep
from idlc.disk.output.tree import Obstacle, Tree, may_be_own
from idlc.disk.output.write_plan import Change, Plan
from idlc.disk.read import absolute

#: The pages that a run wrote, each with its SHA-256.
LISTING = "idlc-docs.json"


def write(out: str, files: Mapping[str, str], report: Report) -> bool:
    """Write files below `out`; report IDL612 to IDL614 and return `False` if that must not be."""
    folder = absolute(out)
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
    mine |= {(renamed[path], one) for path, one in mine if path in renamed}
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


def _in_the_way(shown: str, found: Obstacle | bytes | None) -> Diagnostic:
    what = f"`{shown}` was not written by idlc, or edited since"
    if isinstance(found, Obstacle):
        what = f"cannot write `{shown}`: {found.what}"
    return codes.FOREIGN_FILE.of(shown, what, hint="move it away, or choose another folder with -o")


def _listed(folder: Path, tree: Tree) -> set[tuple[str, str]]:
    """Return the pages that earlier runs wrote and what they wrote, as far as that may be."""
    record = tree.read(LISTING)
    found: set[tuple[str, str]] = set()
    for data in (record if isinstance(record, bytes) else b"", *journals(folder)):
        try:
            listed = json.loads(data)
        except (ValueError, RecursionError):
            continue
        if isinstance(listed, dict):
            found |= {
                (path, one)
                for path, one in listed.items()
                if may_be_own(path) and isinstance(one, str)
            }
    return found
