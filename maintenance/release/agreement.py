"""Facts that several files must agree on: version, changelog, citation, Pythons, repository."""

from __future__ import annotations

import json
import re

from maintenance.release.project import EXTENSION_FILES, RUNTIME, FailedError, Project

PYTHONS = ("3.10", "3.11", "3.12", "3.13", "3.14")


def of_versions(project: Project) -> None:
    """All that has a version has that of idlc, and the changelog begins with it."""
    version = project.version
    heads = re.findall(r"(?m)^## (\S+) \((.*)\)$", project.text("CHANGELOG.md"))
    if not heads or heads[0][0] != version:
        raise FailedError(f"CHANGELOG.md does not begin with ## {version}")
    if f"\nversion: {version}\n" not in project.text("CITATION.cff"):
        raise FailedError(f"CITATION.cff is not for {version}")
    if f'\nversion = "{version}"\n' not in project.text(f"{RUNTIME}/pyproject.toml"):
        raise FailedError(f"{RUNTIME}/pyproject.toml is not for {version}")
    for path in EXTENSION_FILES:
        if json.loads(project.text(path))["version"] != version:
            raise FailedError(f"{path} is not for {version}")


def of_pythons(project: Project) -> None:
    """Classifiers and workflows name every Python that is supported."""
    classifiers = project.metadata["classifiers"]
    named = re.findall(r"Python :: (3\.\d+)'", str(classifiers))
    tested = set(re.findall(r'"(3\.\d+)"', project.text(".github/workflows/ci.yml")))
    if tuple(named) != PYTHONS:
        raise FailedError(f"classifiers name Python {', '.join(named)}")
    if not set(PYTHONS) <= tested:
        raise FailedError(f"ci.yml tests Python {', '.join(sorted(tested))} only")


def for_the_public(project: Project, tag: str) -> None:
    """Nothing is left to be said before this is uploaded as a tag."""
    if project.repository is None:
        raise FailedError("pyproject.toml names no repository: RELEASING.md, once")
    if tag != f"v{project.version}":
        raise FailedError(f"the tag is {tag}, the version {project.version}")
    day = re.findall(r"(?m)^## \S+ \((.*)\)$", project.text("CHANGELOG.md"))[0]
    if not re.fullmatch(r"\d{4}-\d\d-\d\d", day):
        raise FailedError(f"CHANGELOG.md says {day} for the day: RELEASING.md, step 1")
    if changed := project.git("status", "--porcelain").splitlines():
        raise FailedError(f"not all is committed: {changed[0].strip()}")
