"""What a run would change on disk, and what it must not: decided before anything is written."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.disk.output.lock_file import FILE, digest, is_same
from idlc.disk.output.tree import Obstacle, Tree

#: Files of a package that are the user's where they exist already.
YIELDING = frozenset({"__init__.py", "py.typed"})
DIFF_LINES = 40
#: Refused files that are shown with a diff; the others are only named.
DIFFS = 10


class Change(NamedTuple):
    """One file to create, replace or remove; `path` is relative to the package folder.

    `old` and `new` are its content before and after, `None` where there is no file. A change
    with `backup` is to a file that is not idlc's own.
    """

    path: str
    old: bytes | None
    new: bytes | None
    backup: bool = False


class Plan(NamedTuple):
    """Changes in the order in which to make them, and the digests of all files afterwards.

    `record` is what the changes were planned against: the lock's content, if there was one. It
    lies in `home`, which is empty or ends with a slash.
    """

    out: Path
    changes: tuple[Change, ...]
    outputs: dict[str, str]
    record: bytes | None = None
    home: str = ""


def plan(
    out: Path,
    name: str,
    files: Mapping[str, bytes],
    owned: Mapping[str, frozenset[str]],
    report: Report,
    *,
    force: bool = False,
    home: str = "",
) -> Plan | None:
    """Return what to change so that `out` holds `files`; report and return `None` if it must not.

    `owned` are the files that idlc wrote and the digests that it gave them. A file that is not
    owned, or was edited since, is only replaced with `force`. `name` is how messages call `out`.
    Reports IDL613 and IDL614.
    """
    tree = Tree(out)
    record = tree.read(home + FILE)
    changes: list[Change] = []
    refused: list[Diagnostic] = []
    outputs: dict[str, str] = {}
    stale = {path for path in owned if path not in files and path != home + FILE}
    renamed = tree.renamed(stale, files)
    owned = {**owned, **{new: owned[old] | owned.get(new, set()) for old, new in renamed.items()}}
    for path in (*files, *sorted(stale - renamed.keys())):
        old, new = tree.read(path), files.get(path)
        if isinstance(old, Obstacle):
            refused += [_in_the_way(name, path, old)] if new is not None else []
            continue
        ground = _ground(path, old, owned)
        if ground is Ground.USERS:
            continue
        if new is not None:
            outputs[path] = digest(new)
        if not is_same(old, new):
            if ground is not Ground.OWN and not force:
                diff = _diff(old, new) if len(refused) < DIFFS else ""
                refused.append(_refusal(f"{name}/{path}", ground, diff, removed=new is None))
            changes.append(Change(path, old, new, backup=ground is not Ground.OWN))
    if isinstance(record, Obstacle):
        refused.append(_in_the_way(name, home + FILE, record))
    report.extend(refused)
    if refused or isinstance(record, Obstacle):
        return None
    return Plan(out, tuple(changes), outputs, record, home)


class Ground(enum.Enum):
    """What there is where a file is to be written, replaced or removed."""

    OWN = "nothing, or what idlc wrote"
    EDITED = "what idlc wrote, edited since"
    FOREIGN = "a file that idlc did not write"
    USERS = "a file that idlc did not write, and that stays"


def _ground(path: str, old: bytes | None, owned: Mapping[str, frozenset[str]]) -> Ground:
    if old is None or digest(old) in owned.get(path, ()):
        return Ground.OWN
    if path in owned:
        return Ground.EDITED
    return Ground.USERS if path in YIELDING else Ground.FOREIGN


def _in_the_way(name: str, path: str, obstacle: Obstacle) -> Diagnostic:
    return codes.FOREIGN_FILE.of(
        f"{name}/{path}",
        f"cannot write `{name}/{path}`: {obstacle.what}",
        hint="move it away, or choose another folder with -o",
    )


def _refusal(shown: str, ground: Ground, diff: str, *, removed: bool) -> Diagnostic:
    if ground is Ground.FOREIGN:
        return codes.FOREIGN_FILE.of(
            shown,
            f"`{shown}` is in the way and was not written by idlc",
            hint="move it away, choose another folder with -o, or run again with --force, "
            "which keeps a copy",
            detail=diff,
        )
    message = "was edited since idlc wrote it" + (", and is to be removed" if removed else "")
    return codes.EDITED_FILE.of(
        shown,
        f"`{shown}` {message}",
        hint="move the edit out of generated code, or run again with --force, which keeps a copy",
        detail=diff,
    )


def _diff(old: bytes | None, new: bytes | None) -> str:
    return "\n".join(difference(old or b"", new)) if new is not None else ""


def difference(old: bytes, new: bytes) -> Iterator[str]:
    """Yield a unified diff from what is on disk to what idlc would write, cut when long."""
    import difflib

    lines = list(
        difflib.unified_diff(_lines(old), _lines(new), "on disk", "from idlc", lineterm="", n=1)
    )
    yield from lines[:DIFF_LINES]
    if len(lines) > DIFF_LINES:
        yield f"… and {len(lines) - DIFF_LINES} more lines"


def _lines(data: bytes) -> list[str]:
    return data.decode("utf-8", errors="replace").splitlines()


def emptied(changes: Iterable[Change]) -> list[str]:
    """Return the folders that removed files were in, the deepest first."""
    found = {
        str(folder)
        for change in changes
        if change.new is None
        for folder in PurePosixPath(change.path).parents
        if folder.parts
    }
    return sorted(found, key=lambda folder: (-folder.count("/"), folder))
