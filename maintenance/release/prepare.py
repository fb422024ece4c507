"""Writing the version, its day and the place of the repository wherever they stand."""

from __future__ import annotations

import json
import re
from typing import NamedTuple

from maintenance.release.project import EXTENSION, EXTENSION_FILES, RUNTIME, FailedError, Project

#: The paragraphs that say what to do as long as there is no repository and no index.
_UNTIL = re.compile(r"<!-- until idlc is published -->\n.*?<!-- end -->\n\n?", re.DOTALL)
_GITHUB = {"uses: ./tools/idlc": "uses: {name}@v{version}"}
_GITLAB = {"wheels/idlc-*.whl": "idlc=={version}"}
_PRE_COMMIT = {"repo: ../idlc": "repo: {repository}", "rev: HEAD": "rev: v{version}"}
_PLACE = {"https://github.com/OWNER/NAME": "{repository}"}
#: What documents, and templates of `idlc init`, have people paste: before there is one, and after.
PASTED = {
    "README.md": {
        "pip install .\n": "pip install idlc\n",
        "pip install '.[ros]'` in the clone": "pip install 'idlc[ros]'`",
    },
    "docs/ci.md": {**_GITHUB, **_GITLAB, **_PRE_COMMIT},
    "templates/ci/github.yml.jinja": _GITHUB,
    "templates/ci/gitlab.yml.jinja": _GITLAB,
    "templates/ci/pre_commit.yaml.jinja": _PRE_COMMIT,
    "docs/editors.md": {},
    "docs/first-plot.md": {},
    "docs/install.md": {},
    "docs/recordings.md": {},
    "docs/robot.md": {},
    "docs/robot-nodes.md": {},
    "docs/ship-messages.md": {},
    "docs/training-set.md": {},
    "editors/README.md": {**_PLACE, '"OWNER/NAME"': '"{name}"'},
    "editors/emacs/rosmsg-mode.el": _PLACE,
    "editors/mason/package.yaml": _PLACE,
    "editors/neovim/lsp/idlc.lua": _PLACE,
}
#: How an earlier release is named in the same places.
_EARLIER = re.compile(
    r"(idlc==|rev: v|uses: [\w.-]+/[\w.-]+@v|pkg:pypi/idlc@|;; Version: )\d+\.\d+\.\d+(?![\w.])"
)
_URLS = """
[project.urls]
Repository = "{repository}"
Documentation = "{repository}/blob/main/docs/index.md"
Changelog = "{repository}/blob/main/CHANGELOG.md"
Issues = "{repository}/issues"
Security = "{repository}/security/policy"
"""
_NO_CHANGES = (
    "{path} has no part for {version}: add `## {version} (not released yet)` above the other "
    "versions, with what users can see; nothing was written"
)
_NO_VERSION = "{path} names no version; nothing was written"
_REPOSITORY = re.compile(r"https://github\.com/([\w.-]+/[\w.-]+)")


class _Edits(NamedTuple):
    """The files with their edits, all of which are written, or none."""

    project: Project
    texts: dict[str, str]

    def text(self, path: str) -> str:
        """Return the text that a file will have."""
        return self.texts[path] if path in self.texts else self.project.text(path)

    def write(self, path: str, text: str) -> None:
        """Note what a file is to hold."""
        self.texts[path] = text

    def write_json(self, path: str, content: dict[str, object]) -> None:
        """Note what a JSON file is to hold."""
        self.write(path, json.dumps(content, indent=2, ensure_ascii=False) + "\n")

    def substitute(self, path: str, pattern: str, new: str, missing: str) -> None:
        """Replace what is in one place; fail with what is `missing` otherwise."""
        text, number = re.subn(pattern, new, self.text(path))
        if number != 1:
            raise FailedError(missing if not number else f"{path} has {number} places for {new}")
        self.write(path, text)

    def save(self) -> None:
        """Write the files."""
        for path, text in self.texts.items():
            (self.project.root / path).write_text(text, encoding="utf-8")


def publish_at(project: Project, repository: str) -> None:
    """Name the repository where it has to stand; the first release does that once."""
    known = _REPOSITORY.fullmatch(repository)
    if known is None:
        raise FailedError(f"{repository} is not like https://github.com/OWNER/NAME")
    if project.repository is not None:
        raise FailedError(f"pyproject.toml names {project.repository} already")
    edits = _Edits(project, {})
    facts = {"repository": repository, "name": known[1], "version": project.version}
    for path, mark in (
        ("pyproject.toml", "\n[project.optional-dependencies]\n"),
        (f"{RUNTIME}/pyproject.toml", "\n[tool.setuptools.packages.find]\n"),
    ):
        text = edits.text(path)
        edits.write(path, text.replace(mark, _URLS.format(**facts) + mark, 1))
    citation = edits.text("CITATION.cff")
    edits.write("CITATION.cff", f"{citation}repository-code: {repository}\n")
    place = {"type": "git", "url": f"{repository}.git", "directory": EXTENSION}
    manifest = json.loads(edits.text(f"{EXTENSION}/package.json"))
    edits.write_json(f"{EXTENSION}/package.json", {**manifest, "repository": place})
    for path, pairs in PASTED.items():
        text = _UNTIL.sub("", edits.text(path))
        for now, then in pairs.items():
            if now not in text:
                raise FailedError(f"{path} does not say {now}")
            text = text.replace(now, then.format(**facts))
        edits.write(path, text)
    edits.save()


def version_is(project: Project, version: str, day: str | None) -> None:
    """Give the version and its day to everything that names them.

    That is both packages, the extension of VS Code, the changelog, documents and the citation. A
    version in development has no day, and documents keep the release that people can install.
    """
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        raise FailedError(f"{version} is not like 1.2.3")
    if day is not None and not re.fullmatch(r"\d{4}-\d\d-\d\d", day):
        raise FailedError(f"{day} is not like 2026-12-31")
    edits = _Edits(project, {})
    head = f"## {version} ({day or 'not released yet'})"
    for path, pattern, new, missing in (
        ("CHANGELOG.md", rf"## {re.escape(version)} \(.*\)", head, _NO_CHANGES),
        ("idlc/version.py", '__version__ = ".*"', f'__version__ = "{version}"', _NO_VERSION),
        ("CITATION.cff", "version: .*", f"version: {version}", _NO_VERSION),
        (f"{RUNTIME}/pyproject.toml", 'version = ".*"', f'version = "{version}"', _NO_VERSION),
    ):
        edits.substitute(path, f"(?m)^{pattern}$", new, missing.format(path=path, version=version))
    manifest, lock = (json.loads(edits.text(path)) for path in EXTENSION_FILES)
    for part in (manifest, lock, lock["packages"][""]):
        part["version"] = version
    for path, content in zip(EXTENSION_FILES, (manifest, lock), strict=True):
        edits.write_json(path, content)
    text = re.sub(r"(?m)^date-released: .*\n", "", edits.text("CITATION.cff"))
    edits.write("CITATION.cff", f"{text}date-released: {day}\n" if day else text)
    for path in PASTED:
        if day or path.startswith("editors/"):
            edits.write(path, _EARLIER.sub(rf"\g<1>{version}", edits.text(path)))
    edits.save()
