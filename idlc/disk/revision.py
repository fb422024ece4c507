"""The interface files of a git revision, in a folder of their own."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import NamedTuple

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.visible import one_line
from idlc.disk.exclude import Exclusions
from idlc.disk.find import CLOSING, KINDS, InterfaceFile, look
from idlc.disk.packages.enclosing import MANIFEST
from idlc.disk.read import absolute


class Revision(NamedTuple):
    """A revision's interface files below `root`, laid out as in the repository at `top`."""

    name: str
    top: Path
    root: Path

    def counterpart(self, path: str) -> str | None:
        """Return where a path of the working tree is in the revision; `None` outside of it."""
        try:
            return (self.root / absolute(path).resolve().relative_to(self.top)).as_posix()
        except ValueError:
            return None

    def files(
        self, paths: Iterable[str], exclude: Exclusions, report: Report
    ) -> tuple[InterfaceFile, ...]:
        """Return the interface files that paths of the working tree meant; there may be none."""
        there = [place for path in paths if (place := self.counterpart(path))]
        places = [place for place in there if Path(place).exists()]
        found = look(places, report, exclude.seen_from(self.root, self.top)).files
        return tuple(msgspec.structs.replace(file, shown=self._shown(file.path)) for file in found)

    def _shown(self, path: Path) -> str:
        """Return how a file of the revision is called in messages."""
        return f"git:{self.name}:{path.relative_to(self.root).as_posix()}"


@contextmanager
def checked_out(name: str, path: str, report: Report) -> Iterator[Revision | None]:
    """Provide the revision `name` of the repository that holds `path`, `None` after IDL630.

    Nothing in the repository is touched.
    """
    top = _git(_folder(path), ["rev-parse", "--show-toplevel"])
    commit = _commit(name, path) if top else None
    if not top or not commit:
        what = "no such revision" if top else "not in a git repository"
        hint = "in CI, fetch it first; a shallow clone lacks older revisions" if top else None
        report.add(codes.NO_SUCH_REVISION.of(path, f"{what}: `git:{name}`", hint=hint))
        yield None
        return
    with TemporaryDirectory(prefix="idlc-") as place:
        root = Path(place).resolve()
        (root / ".git").mkdir()  # what is above is not part of the repository
        _extract(Path(_text(top)), _text(commit), root)
        yield Revision(name, Path(_text(top)).resolve(), root)


def is_revision(name: str, path: str) -> bool:
    """Return whether a name means a revision of the repository that holds `path`, and no file."""
    return not os.path.lexists(name) and _commit(name, path) is not None


def _commit(name: str, path: str) -> bytes | None:
    if not name or name.startswith("-"):
        return None
    return _git(_folder(path), ["rev-parse", "--verify", "--quiet", f"{name}^{{commit}}"])


def commit(name: str, path: str) -> str | None:
    """Return which commit a name means in the repository that holds `path`, if it means one."""
    found = _commit(name, path)
    return _text(found) if found else None


def places(path: str) -> tuple[Path, ...]:
    """Return the folders in which git keeps HEAD and branches, for the working tree of `path`."""
    words = ["rev-parse", "--path-format=absolute", "--git-dir", "--git-common-dir"]
    found = _git(_folder(path), words)
    return tuple(dict.fromkeys(Path(line) for line in _text(found).splitlines())) if found else ()


def _folder(path: str) -> Path:
    folder = absolute(path)
    return folder if folder.is_dir() else folder.parent


def _text(output: bytes) -> str:
    return output.decode("utf-8", "surrogateescape").rstrip("\n")


def _git(folder: Path, words: Sequence[str], given: bytes = b"") -> bytes | None:
    """Return what git prints; `None` if it fails or is not there."""
    try:
        done = subprocess.run(  # noqa: S603 - no shell, and no option can be smuggled in
            ["git", "-C", str(folder), *words],  # noqa: S607 - the user's own git
            input=given,
            capture_output=True,
            check=False,
        )
    except OSError:
        return None
    return done.stdout if done.returncode == 0 else None


def setting(name: str) -> str:
    """Return one of the user's settings of git, on one line; empty if there is none."""
    found = _git(absolute("."), ["config", "--get", name]) or b""
    return one_line(found.decode("utf-8", errors="replace").strip())


def _extract(top: Path, commit: str, root: Path) -> None:
    """Write the interface files and package.xml files of a commit below `root`."""
    listed = _git(top, ["ls-tree", "-r", "-z", "--full-tree", commit]) or b""
    wanted = [(kind, path) for kind, path in map(_entry, listed.split(b"\0")) if _is_wanted(path)]
    asked = "".join(f"{identity}\n" for identity, _ in wanted).encode()
    stream = _git(top, ["cat-file", "--batch"], asked) or b""
    at = 0
    for _, path in wanted:
        end = stream.index(b"\n", at)
        size = int(stream[at:end].split()[2])
        target = root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(stream[end + 1 : end + 1 + size])
        at = end + 1 + size + 1


def _entry(line: bytes) -> tuple[str, str]:
    """Return a tree entry's object and path; empty for anything but a regular file."""
    about, _, path = line.partition(b"\t")
    mode, _, rest = about.partition(b" ")
    name = path.decode("utf-8", "surrogateescape")
    return (rest.split()[-1].decode(), name) if mode.startswith(b"100") else ("", "")


def _is_wanted(path: str) -> bool:
    pure = PurePosixPath(path)
    inside = not pure.is_absolute() and ".." not in pure.parts
    return inside and (pure.suffix in KINDS or pure.name in (MANIFEST, *CLOSING))
