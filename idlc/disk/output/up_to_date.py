"""Whether a run can be left out: nothing that its output depends on has changed."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path

from idlc import __version__
from idlc.disk.library import Library
from idlc.disk.output.lock_file import FILE, Lock, digest, meaning
from idlc.disk.output.tree import Obstacle, Tree
from idlc.disk.read import is_folder
from idlc.model.ir import TypeName

_PACKAGE = Path(__file__).parents[2]
#: What makes the output, beside what is given: a change here counts although the version stays.
_MAKERS = (
    *(_PACKAGE / part for part in ("diagnostics", "syntax", "model", "checks", "emit", "runtime")),
    _PACKAGE / "templates",
    _PACKAGE.parent / "templates",
)
#: The support code by digest: packages have the same, and comparing is faster than hashing.
_support: dict[str, bytes] = {}
_MOST = 128


def unchanged(
    out: Path,
    lock: Lock | None,
    package: str,
    inputs: Mapping[str, str],
    library: Library,
    *,
    vendor_deps: bool = False,
) -> bool:
    """Return whether the package in `out` is what a run would write.

    `inputs` are the digests of the input files by name within the package.
    """
    return (
        lock is not None
        and (lock.idlc, lock.package, lock.vendor_deps) == (__version__, package, vendor_deps)
        and bool(lock.converts_values) == library.distro.converts_values
        and lock.inputs == inputs
        and _outputs_stand(out, lock)
        and not _idlc_is_newer(out / FILE)
        and all(_dependency(name, library) == one for name, one in lock.dependencies.items())
    )


def dependencies(names: Iterable[TypeName], library: Library) -> dict[str, str]:
    """Return the digests by which interfaces of other packages are recorded."""
    return {str(name): _dependency(str(name), library) for name in names}


def _dependency(name: str, library: Library) -> str:
    try:
        parsed = TypeName.parse(name)
    except ValueError:
        return ""
    source = library.source(parsed)
    return meaning(source.text, parsed.package) if source else ""


def _outputs_stand(out: Path, lock: Lock) -> bool:
    tree = Tree(out)
    for path, expected in lock.outputs.items():
        content = tree.read(path)
        if content is None or isinstance(content, Obstacle) or not _has(content, expected, path):
            return False
    return True


def _has(content: bytes, expected: str, path: str) -> bool:
    """Return whether a file's content has a digest."""
    if _support.get(expected) == content:
        return True
    if digest(content) != expected:
        return False
    if "_idlc/" in path and len(_support) < _MOST:
        _support[expected] = content
    return True


def _idlc_is_newer(path: Path) -> bool:
    """Return whether idlc was changed after a lock was written: by a developer, or installed."""
    return _newest_maker() > path.stat().st_mtime_ns


@lru_cache(maxsize=1)
def _newest_maker() -> int:
    return last_change(_MAKERS)


def last_change(folders: Iterable[Path]) -> int:
    """Return when a file in these folders, or in those in them, was changed last."""
    return max(map(_newest, filter(is_folder, folders)))


def _newest(folder: str | Path) -> int:
    newest = 0
    for entry in os.scandir(folder):
        if entry.is_file():
            newest = max(newest, entry.stat().st_mtime_ns)
        elif not entry.name.startswith((".", "__")):  # caches
            newest = max(newest, _newest(entry.path))
    return newest
