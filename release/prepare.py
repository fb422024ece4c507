"""Writing the version, its day and the place of the repository wherever they stand."""

from __future__ import annotations

import json
import re

from release.project import EXTENSION, EXTENSION_FILES, FailedError, Project

#: The paragraphs that say what to do as long as there is no repository and no index.
_UNTIL = re.compile(r"<!-- until idlc is published -->\n.*?<!-- end -->\n\n?", re.DOTALL)
#: What documents tell people to paste: as long as there is none, and from then on.
PASTED = {
    "README.md": {
        "    pip install .            # '.[ros]'": "    pip install idlc         # 'idlc[ros]'",
    },
    "docs/ci.md": {
        "wheels/idlc-*.whl": "idlc=={version}",
        "repo: ../idlc": "repo: {repository}",
        "rev: HEAD": "rev: v{version}",
        "uses: ./tools/idlc": "uses: {name}@v{version}",
    },
    "docs/install.md": {},
    "docs/interface-packages.md": {},
}
#: How an earlier release is named in the same places.
_EARLIER = re.compile(r"(idlc==|rev: v|uses: [\w.-]+/[\w.-]+@v)\d+\.\d+\.\d+(?![\w.])")
_URLS = """
[project.urls]
Repository = "{repository}"
Documentation = "{repository}/blob/main/docs/index.md"
Changelog = "{repository}/blob/main/CHANGELOG.md"
Issues = "{repository}/issues"
Security = "{repository}/security/policy"
"""
_REPOSITORY = re.compile(r"https://github\.com/([\w.-]+/[\w.-]+)")


def publish_at(project: Project, repository: str) -> None:
    """Name the repository where it has to stand; the first release does that once."""
    known = _REPOSITORY.fullmatch(repository)
    if known is None:
        raise FailedError(f"{repository} is not like https://github.com/OWNER/NAME")
    if project.repository is not None:
        raise FailedError(f"pyproject.toml names {project.repository} already")
    facts = {"repository": repository, "name": known[1], "version": project.version}
    text = project.text("pyproject.toml")
    mark = "\n[project.optional-dependencies]\n"
    _write(project, "pyproject.toml", text.replace(mark, _URLS.format(**facts) + mark, 1))
    citation = project.text("CITATION.cff")
    _write(project, "CITATION.cff", f"{citation}repository-code: {repository}\n")
    place = {"type": "git", "url": f"{repository}.git", "directory": EXTENSION}
    manifest = json.loads(project.text(f"{EXTENSION}/package.json"))
    _write_json(project, f"{EXTENSION}/package.json", {**manifest, "repository": place})
    for path, pairs in PASTED.items():
        text = _UNTIL.sub("", project.text(path))
        for now, then in pairs.items():
            if now not in text:
                raise FailedError(f"{path} does not say {now}")
            text = text.replace(now, then.format(**facts))
        _write(project, path, text)


def version_is(project: Project, version: str, day: str) -> None:
    """Give the version and its day to everything that names them.

    That is the package, the extension of VS Code, the changelog, documents and the citation.
    """
    line = f'__version__ = "{version}"'
    _substitute(project, "idlc/__init__.py", r'(?m)^__version__ = ".*"$', line)
    manifest, lock = (json.loads(project.text(path)) for path in EXTENSION_FILES)
    for part in (manifest, lock, lock["packages"][""]):
        part["version"] = version
    for path, content in zip(EXTENSION_FILES, (manifest, lock), strict=True):
        _write_json(project, path, content)
    head = rf"(?m)^## {re.escape(version)} \(.*\)$"
    _substitute(project, "CHANGELOG.md", head, f"## {version} ({day})")
    _substitute(project, "CITATION.cff", r"(?m)^version: .*$", f"version: {version}")
    text = re.sub(r"(?m)^date-released: .*\n", "", project.text("CITATION.cff"))
    _write(project, "CITATION.cff", f"{text}date-released: {day}\n")
    for path in PASTED:
        _write(project, path, _EARLIER.sub(rf"\g<1>{version}", project.text(path)))


def _substitute(project: Project, path: str, pattern: str, new: str) -> None:
    text, number = re.subn(pattern, new, project.text(path))
    if number != 1:
        raise FailedError(f"{path} has {number} places like {pattern}")
    _write(project, path, text)


def _write_json(project: Project, path: str, content: dict[str, object]) -> None:
    _write(project, path, json.dumps(content, indent=2, ensure_ascii=False) + "\n")


def _write(project: Project, path: str, text: str) -> None:
    (project.root / path).write_text(text, encoding="utf-8")
