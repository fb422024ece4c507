"""Compares a generated package with the one that a run would write."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path

from idlc.generate.target import Target
from idlc.model.ir import TypeName
from idlc.project import write
from idlc.project.library import Library
from idlc.project.lock import BUILD_STEP, COPY_HEAD, FILE, Lock, Tree, Vendoring, digest, meaning
from idlc.version import __version__

_PACKAGE = Path(__file__).parents[1]
#: The sources of idlc that affect the output: a change counts although the version stays.
_ROOMS = (
    *("build", "compiler", "diagnostics", "generate", "language", "model"),
    *("project", "runtime", "tasks", "wire"),
)
_MAKERS = (
    *(_PACKAGE / room for room in _ROOMS),
    _PACKAGE / "templates",
    _PACKAGE.parent / "templates",
)


def unchanged(
    target: Target, inputs: Mapping[str, str], library: Library, vendoring: Vendoring = ""
) -> bool:
    """Return whether compiling the inputs would change nothing in a package's folder.

    `inputs` are the digests of the input files by name within the package. In a prefix they
    do not show it: libraries depend on the installed distribution, too.
    """
    lock = None if target.home else target.lock
    is_unchanged = (
        lock is not None
        and (lock.idlc, lock.package) == (__version__, target.package)
        and lock.runtime == target.runtime
        and lock.enums == target.enums
        and lock.vendors_as(vendoring)
        and bool(lock.converts_values) == library.distro.converts_values
        and lock.inputs == inputs
        and _outputs_stand(target.path, lock)
        and target.step.keys() == lock.outputs.keys() & {BUILD_STEP}
        and _carries_this_runtime(lock)
        and _newest_maker() <= (target.path / FILE).stat().st_mtime_ns
        and all(_dependency(name, library) == old for name, old in lock.dependencies.items())
    )
    if is_unchanged:
        write.sweep(target.path)
    return is_unchanged


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
    contents = ((tree.read(path), expected) for path, expected in lock.outputs.items())
    return all(
        isinstance(content, bytes) and digest(content) == expected for content, expected in contents
    )


def _carries_this_runtime(lock: Lock) -> bool:
    """Return whether the copy of the runtime is this idlc's, or there is none.

    Its version does not say so: those of two builds between two releases are equal.
    """
    copy = {
        path.rpartition("_idlc/")[2]: content
        for path, content in lock.outputs.items()
        if "/_idlc/" in f"/{path}"
    }
    return not copy or copy == _runtime()


@lru_cache(maxsize=1)
def _runtime() -> dict[str, str]:
    runtime = _PACKAGE / "runtime"
    return {
        path.relative_to(runtime).as_posix(): digest(COPY_HEAD.encode() + path.read_bytes())
        for path in runtime.rglob("*.py")
    }


@lru_cache(maxsize=1)
def _newest_maker() -> int:
    """Return the time at which idlc was last changed: by a developer, or installed."""
    files = (path for folder in _MAKERS for path in folder.rglob("*.*") if path.suffix != ".pyc")
    return max(path.stat().st_mtime_ns for path in files)
