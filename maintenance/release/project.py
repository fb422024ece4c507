"""The project as a release sees it: its files, its version, and where it is published."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

#: What a source distribution holds besides the package.
BESIDE = ("LICENSE", "README.md", "pyproject.toml")
#: The folder that describes idlc-runtime.
RUNTIME = "maintenance/runtime"
#: The extension of VS Code.
EXTENSION = "editors/vscode"
#: Its files that have a version.
EXTENSION_FILES = (f"{EXTENSION}/package.json", f"{EXTENSION}/package-lock.json")


class Project(NamedTuple):
    """A checkout of the project."""

    root: Path

    def text(self, path: str) -> str:
        """Return a file's text."""
        return (self.root / path).read_text(encoding="utf-8")

    @property
    def version(self) -> str:
        """The version, which stands in the package itself."""
        found: list[str] = re.findall(r'(?m)^__version__ = "(.*)"$', self.text("idlc/version.py"))
        return found[0]

    @property
    def metadata(self) -> dict[str, object]:
        """The table `[project]`."""
        if sys.version_info >= (3, 11):  # here, because `make vscode` does without packages
            import tomllib
        else:
            import tomli as tomllib

        found: dict[str, object] = tomllib.loads(self.text("pyproject.toml"))["project"]
        return found

    @property
    def repository(self) -> str | None:
        """Where the project is published, as `[project.urls]` says; `None` until it is."""
        urls = self.metadata.get("urls")
        return urls.get("Repository") if isinstance(urls, dict) else None

    def files(self) -> list[str]:
        """Return the paths of all files that git has, or would take."""
        words = ("ls-files", "-z", "--cached", "--others", "--exclude-standard")
        listed = self.git(*words).split("\0")
        return sorted(path for path in set(listed) if path and (self.root / path).is_file())

    def sources(self, folders: Mapping[str, str]) -> dict[str, str]:
        """Return the files in some folders, by what they are called in a package.

        `folders` are those of the repository, and what they are called there.
        """
        return {
            f"{inside}/{path.removeprefix(folder + '/')}": path
            for path in self.files()
            for folder, inside in folders.items()
            # ruff.toml tells how this repository is linted
            if path.startswith(f"{folder}/") and not path.endswith("/ruff.toml")
        }

    def git(self, *words: str) -> str:
        """Return what git prints."""
        command = ["git", "-C", str(self.root), *words]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    def moment(self) -> int:
        """Return when the last commit was made, which is the time in the archives."""
        return int(self.git("log", "-1", "--format=%ct"))

    def copy(self, files: Mapping[str, str], folder: Path) -> None:
        """Copy files into a folder, by their paths there, with the same permissions everywhere."""
        for path, source in files.items():
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(self.root / source, target)
            target.chmod(0o644)
        readme = folder / "README.md"
        readme.write_text(self.shown(readme.read_text(encoding="utf-8")), encoding="utf-8")

    def shown(self, text: str) -> str:
        """Return a README as an index shows it, where links to files lead nowhere."""
        if self.repository is None:
            return text
        there = f"{self.repository}/blob/v{self.version}/"
        return re.sub(r"\]\((?![a-z]+:|#)", f"]({there}", text)


def run(*words: object, cwd: Path, **variables: str) -> str:
    """Return what a program printed; raises `FailedError` with that if it fails."""
    done = subprocess.run(
        [str(word) for word in words],
        cwd=cwd,
        env={**os.environ, **variables},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        umask=0o022,
    )
    if done.returncode:
        raise FailedError(f"{Path(str(words[0])).name} {words[1]}: {done.stdout.strip()}")
    return done.stdout


class FailedError(Exception):
    """Something that a release needs is not so."""
