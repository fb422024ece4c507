"""Git repositories on disk: the top of each, the answers of git, and the links that it tracks.

Repositories are not trusted: programs that their settings name are not run, nothing is fetched.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryFile
from threading import Timer

from idlc.diagnostics.text import one_line
from idlc.project.files import reason

#: Bytes; the longest answer of git that is read. A few kilobytes can name billions of files.
MOST = 128 << 20
#: Seconds that one answer may take. Settings can include a pipe, names can hold patterns.
PATIENCE = 120.0
_HASH = re.compile(rb"[0-9a-f]{40}(?:[0-9a-f]{24})?")
#: The mode of a link.
LINK = b"120000"
#: Settings that could otherwise have git run programs. Older versions know some of them only.
_SETTINGS = {
    "safe.bareRepository": "explicit",
    "core.fsmonitor": "false",
    "core.hooksPath": os.devnull,
    "core.pager": "cat",
}
#: The first one counts for more than any settings, those for single protocols included.
_ENVIRONMENT = {
    "GIT_ALLOW_PROTOCOL": "none",
    "GIT_NO_LAZY_FETCH": "1",
    "GIT_TERMINAL_PROMPT": "0",
    "GIT_OPTIONAL_LOCKS": "0",
    "LC_ALL": "C",
}
#: Variables that name a repository, as hooks of git have them: here, a path does.
_ELSEWHERE = frozenset(
    "GIT_DIR GIT_WORK_TREE GIT_COMMON_DIR GIT_INDEX_FILE GIT_OBJECT_DIRECTORY "
    "GIT_ALTERNATE_OBJECT_DIRECTORIES GIT_NAMESPACE GIT_PREFIX".split()
)
#: Prefixes of git's error messages.
_BAD = ("fatal: ", "error: ")


class GitError(Exception):
    """Git could not answer; the text is the reason, and `hint` the remedy.

    Without a hint, something is missing or damaged in the repository; an empty one is for problems
    that cannot be repaired there.
    """

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


def repository_of(path: Path) -> Path | None:
    """Return the closest folder around a path that has a `.git`.

    Git would also take a tracked folder for a repository that only looks like the inside of one.
    """
    real = path.resolve()
    folders = (real, *real.parents)
    return next((folder for folder in folders if os.path.lexists(folder / ".git")), None)


def tracked_links(top: Path) -> frozenset[str] | None:
    """Return the links that git tracks in a repository, `None` if it cannot say."""
    try:
        listed = run_git(top, ["ls-files", "--stage", "-z"])
    except GitError:
        return None
    entries = (entry.partition(b"\t") for entry in listed.split(b"\0") if entry[:6] == LINK)
    return frozenset(path.decode("utf-8", "surrogateescape") for _, _, path in entries)


def _program() -> str:
    """Return the git on PATH; a program in the working folder is not trusted."""
    name = "git.exe" if os.name == "nt" else "git"
    for entry in map(Path, os.get_exec_path()):
        if entry.is_absolute() and os.access(entry / name, os.X_OK) and (entry / name).is_file():
            return str(entry / name)
    raise GitError("`git` is not on PATH", "")


def run_git(top: Path, words: Sequence[str], input_: bytes = b"", otherwise: str = "") -> bytes:
    """Return git's output; raise GitError, with git's own message, if it fails.

    `otherwise` is the reason if git gives none.
    """
    options = [word for pair in _SETTINGS.items() for word in ("-c", "=".join(pair))]
    command = [_program(), *options, *words]
    kept = {name: value for name, value in os.environ.items() if name not in _ELSEWHERE}
    try:
        with TemporaryFile() as stdin, TemporaryFile() as stderr:
            stdin.write(input_)
            stdin.seek(0)
            with subprocess.Popen(  # noqa: S603 - no shell, and no option can be smuggled in
                command,
                cwd=top,
                stdin=stdin,
                stdout=subprocess.PIPE,
                stderr=stderr,
                env=kept | _ENVIRONMENT,
            ) as process:
                assert process.stdout is not None
                timer = Timer(PATIENCE, process.kill)
                timer.start()
                try:
                    answer = process.stdout.read(MOST + 1)
                finally:
                    timer.cancel()
                if len(answer) > MOST:
                    process.kill()
                    raise GitError(f"more than {MOST >> 20} MiB of files", "")
            stderr.seek(0)
            lines = list(filter(None, stderr.read(10_000).decode("utf-8", "replace").splitlines()))
    except (OSError, ValueError) as error:
        raise GitError(f"git cannot be run: {reason(error)}", "") from None
    if process.returncode:
        why = otherwise or f"`git {words[0]}` exited with status {process.returncode}"
        bad = [line[len(_BAD[0]) :] for line in lines if line.startswith(_BAD)]
        said_to_do = next((line.strip() for line in lines if line.startswith("\tgit ")), "")
        hint = f"`{one_line(said_to_do)}`" if said_to_do else None
        raise GitError("; ".join(dict.fromkeys(bad)) or next(iter(lines), why), hint)
    return answer


def commit(name: str, path: Path) -> str | None:
    """Return the commit of a name in the repository that holds `path`; `None` if it has none."""
    with suppress(GitError):
        return commit_in(name, repository(path))
    return None


def setting(name: str, folder: Path) -> str:
    """Return a setting of git for a folder, on one line; empty if there is none."""
    with suppress(GitError):
        value = run_git(repository_of(folder) or folder, ["config", "--get", name])
        return one_line(value.decode("utf-8", errors="replace").strip())
    return ""


def repository(path: Path) -> Path:
    """Return the top of the working tree that holds a path."""
    top = repository_of(path)
    if top is None:
        raise GitError("not in a git repository")
    other = os.fsdecode(run_git(top, ["rev-parse", "--show-toplevel"]).rstrip(b"\r\n"))
    if not other or Path(other).resolve() != top:
        raise GitError(f"`{top.as_posix()}` is not the top of a working tree")
    return top


def commit_in(name: str, top: Path) -> str:
    """Return the commit of a name in the repository at `top`; raise GitError if it has none."""
    identity = b""
    if name and not name.startswith("-"):
        words = ["rev-parse", "--verify", "--quiet", f"{name}^{{commit}}"]
        identity = run_git(top, words, otherwise="no such revision").rstrip()
    if not _HASH.fullmatch(identity):
        raise GitError("no such revision")
    return identity.decode()
