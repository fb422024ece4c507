"""The interface files of a git revision, in a folder of their own."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import NamedTuple

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import one_line
from idlc.project.files import reason
from idlc.project.find import CLOSING, KINDS, Exclusions, FileListing, InterfaceFile, list_files
from idlc.project.git import (
    LINK,
    GitError,
    commit,
    commit_in,
    repository,
    repository_of,
    run_git,
)
from idlc.project.library import IDL
from idlc.project.root import MANIFEST, Root

_ENTRY = re.compile(rb"(100\d{3}|120000|160000) \w+ ([0-9a-f]+)\t(.+)", re.DOTALL)
_SUBMODULE = b"160000"
_NAMES = "`git branch --all` and `git tag` list the revisions; `git fetch` updates them"
_DAMAGED = "`git fsck` lists missing or damaged objects"


class Revision(NamedTuple):
    """A revision's interface files below `folder`, laid out as in the repository at `top`.

    `submodules` are the paths of its submodules, whose files are not below `folder`. `skipped` are
    the paths that git does not check out, as in a sparse checkout. Paths of the working tree are
    relative to `root`.
    """

    name: str
    top: Path
    folder: Path
    root: Root
    submodules: tuple[str, ...] = ()
    skipped: frozenset[str] = frozenset()

    def counterpart(self, path: str) -> str | None:
        """Return the path in the revision for one of the working tree; `None` outside of it."""
        with suppress(ValueError):
            inside = self.root.absolute(path).resolve().relative_to(self.top)
            return (self.folder / inside).as_posix()
        return None

    def files(
        self, paths: Iterable[str], exclude: Exclusions, report: Report
    ) -> tuple[InterfaceFile, ...]:
        """Return the interface files that paths of the working tree meant; there may be none."""
        return self.listing(paths, exclude, report).files

    def listing(self, paths: Iterable[str], exclude: Exclusions, report: Report) -> FileListing:
        """Return what paths of the working tree meant in the revision; there may be nothing."""
        places = [place for place in map(self.counterpart, paths) if place and Path(place).exists()]
        left_out = exclude.seen_from(self.folder, self.top)
        listed = list_files(places, self.root, report, left_out)
        files = (
            msgspec.structs.replace(each, shown=self.shown(each.path)) for each in listed.files
        )
        return msgspec.structs.replace(listed, files=tuple(files))

    def holds(self, path: Path) -> bool:
        """Return whether a file of the working tree is in this repository, not in another."""
        return repository_of(path) == self.top

    def unknown(self, paths: Iterable[str]) -> Iterator[str]:
        """Yield the submodules below paths that are none any more: their files are not known."""
        places = [Path(place) for path in paths if (place := self.counterpart(path))]
        for name in self.submodules:
            now = self.top / name
            is_meant = any((self.folder / name).is_relative_to(place) for place in places)
            # a folder that is empty was not checked out
            if is_meant and not os.path.lexists(now / ".git") and not _is_empty(now):
                yield name

    def is_present(self, path: Path) -> bool:
        """Return whether the working tree has a file or folder of the revision, too."""
        return os.path.lexists(self.top / path.relative_to(self.folder))

    def is_skipped(self, shown: str) -> bool:
        """Return whether git keeps a file of the revision, or a link to it, out of the tree."""
        path = PurePath(shown.removeprefix(self.shown(self.folder)[:-1]))
        names = (ancestor.as_posix() for ancestor in (path, *path.parents))
        return any(name in self.skipped for name in names) and not os.path.lexists(self.top / path)

    def shown(self, path: Path) -> str:
        """Return the name of a file or folder of the revision in messages."""
        return f"git:{self.name}:{path.relative_to(self.folder).as_posix()}"


@contextmanager
def checked_out(name: str, path: str, root: Root, report: Report) -> Iterator[Revision]:
    """Provide the revision `name` of the repository that holds `path`; IDL630 ends it.

    Nothing in the repository is touched.
    """
    with TemporaryDirectory(prefix="idlc-") as place:
        folder = Path(place).resolve()
        (folder / ".git").mkdir()  # folders above are not part of the repository
        hint, top = "", Path()
        try:
            top = repository(root.absolute(path))
            hint = _NAMES
            identity = commit_in(name, top)
            hint = _DAMAGED
            entries = _extract(top, identity, folder)
            submodules = tuple(entry.path for entry in entries if entry.mode == _SUBMODULE)
            skipped = _skipped(top, entries)
        except GitError as error:
            message = f"cannot read `git:{name}`: {one_line(str(error))}"
            if error.hint is None and hint:
                hint = _completing(top) or hint
            advice = hint if error.hint is None else error.hint
            problem = codes.NO_SUCH_REVISION.of(path, message, hint=advice or None)
            raise report.refused(problem) from None
        yield Revision(name, top, folder, root, submodules, skipped)


def _completing(top: Path) -> str:
    """Return the hint that completes a shallow or partial clone; empty for any other clone."""
    with suppress(GitError):
        if run_git(top, ["rev-parse", "--is-shallow-repository"]).strip() == b"true":
            return "this clone is shallow: `git fetch --unshallow` completes it"
        run_git(top, ["config", "--get-regexp", r"^remote\..*\.promisor$", "^true$"])
        return "this clone is partial: `git fetch --refetch --no-filter` completes it"
    return ""


def is_revision(name: str, path: str, root: Root) -> bool:
    """Return whether a name is a revision of the repository that holds `path`, and no file."""
    return not os.path.lexists(root.path(name)) and commit(name, root.absolute(path)) is not None


def _extract(top: Path, commit: str, root: Path) -> list[_Entry]:
    """Write a commit's interface files, package.xml files and links; return all its entries."""
    listed = run_git(top, ["ls-tree", "-r", "-z", "--full-tree", commit])
    *lines, rest = listed.split(b"\0")
    entries = []
    for line in lines:
        match = _ENTRY.fullmatch(line)
        if match is None:
            raise GitError("git's list of files is damaged")
        path = match[3].decode("utf-8", "surrogateescape")
        entries.append(_Entry(match[1], match[2], path))
    selected = [entry for entry in entries if _is_wanted(entry)]
    names = list(dict.fromkeys(entry.identity for entry in selected))
    contents = dict(zip(names, _contents(top, names), strict=True))
    if rest:
        raise GitError("git's list of files is cut off")
    try:
        for mode, identity, path in selected:
            target = root / path
            target.parent.mkdir(parents=True, exist_ok=True)
            if mode != LINK:
                target.write_bytes(contents[identity])
        links = {path: contents[identity] for mode, identity, path in selected if mode == LINK}
        _link(root, links)
    except (OSError, ValueError) as error:
        raise GitError(f"its files cannot be written to `{root}`: {reason(error)}", "") from None
    return entries


def _skipped(top: Path, entries: Iterable[_Entry]) -> frozenset[str]:
    """Return the paths that git keeps out of the working tree, if a file of a commit is absent."""
    if all(os.path.lexists(top / entry.path) for entry in entries if _is_wanted(entry)):
        return frozenset()
    *lines, rest = run_git(top, ["ls-files", "-t", "-z"]).split(b"\0")
    if rest or not all(line[1:2] == b" " for line in lines):
        raise GitError("git's list of files is damaged")
    skipped = (line[2:].decode("utf-8", "surrogateescape") for line in lines if line[:1] == b"S")
    return frozenset(skipped)


def _link(root: Path, links: dict[str, bytes]) -> None:
    """Make a revision's links, except links that lead out of it."""
    created = []
    for path, content in links.items():
        target = root / path
        with suppress(OSError, ValueError):  # not every system has links
            target.symlink_to(os.fsdecode(content))
            created.append(target)
    for target in created:
        try:
            target.stat()  # the system follows a few links only, so that few are resolved
            is_inside = target.resolve().is_relative_to(root)
        except OSError:
            is_inside = False
        if not is_inside:
            target.unlink()


class _Entry(NamedTuple):
    mode: bytes
    identity: bytes
    path: str


def _contents(top: Path, names: Sequence[bytes]) -> Iterator[bytes]:
    """Yield the contents of objects, which have to be files."""
    request = b"".join(name + b"\n" for name in names)
    answer = run_git(top, ["cat-file", "--batch"], request) if names else b""
    at = 0
    for name in names:
        end = answer.find(b"\n", at)
        head = answer[at:end].split(b" ")
        if end < 0 or len(head) != 3 or head[:2] != [name, b"blob"] or not head[2].isdigit():
            raise GitError(f"git does not have all of its files: {name.decode()} is missing")
        at = end + 1 + int(head[2])
        if answer[at : at + 1] != b"\n":
            raise GitError(f"git's output is cut off in {name.decode()}")
        yield answer[end + 1 : at]
        at += 1


def _is_wanted(entry: _Entry) -> bool:
    pure = PurePath(entry.path)
    is_inside = not pure.anchor and ".." not in pure.parts
    if entry.mode == LINK:
        return is_inside
    is_wanted = pure.suffix in {*KINDS, IDL} or pure.name in (MANIFEST, *CLOSING)
    return is_inside and is_wanted and entry.mode.startswith(b"100")


def _is_empty(folder: Path) -> bool:
    try:
        return not any(folder.iterdir())
    except OSError:
        return False
