"""What idlc is built from: bounded in pyproject.toml, and fixed to the byte by locks."""

import re
import sys

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

from tests.support.paths import ROOT

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]
#: Lock files, and the extra that each is for.
LOCKED = {
    "release": "release",
    "test-ros": "test-ros",
    "test-kilted": "test-kilted",
    "test-robot": "test-robot",
    "test-lowest": "test",
}
#: Where CI runs, on each interpreter.
MACHINES = [
    {
        "python_version": version,
        "python_full_version": f"{version}.9",
        "sys_platform": "linux",
        "platform_machine": "x86_64",
        "os_name": "posix",
        "implementation_name": "cpython",
        "platform_python_implementation": "CPython",
    }
    for version in ("3.10", "3.11", "3.12", "3.13", "3.14")
]


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def wanted(texts: list[str]) -> list[Requirement]:
    """Return requirements with the extras of idlc's own written out."""
    found = []
    for requirement in map(Requirement, texts):
        if requirement.name == "idlc":
            found += [r for extra in sorted(requirement.extras) for r in wanted(EXTRAS[extra])]
        else:
            found.append(requirement)
    return found


def locked(name: str) -> list[tuple[Requirement, str]]:
    """Return each requirement of a lock file, with what else its entry says."""
    text = (ROOT / "maintenance/requirements" / f"{name}.txt").read_text(encoding="utf-8")
    lines = re.sub(r"(?m)^#.*\n", "", text).replace("\\\n", "").splitlines()
    parts = [re.split(r"\s(?=--)", line, maxsplit=1) for line in lines]
    return [(Requirement(words[0]), words[1] if words[1:] else "") for words in parts]


def entries_for(name: str, machine: dict[str, str]) -> dict[str, str]:
    """Return the version of each package that a lock file installs on a machine, one of each."""
    found = [
        (normal(requirement.name), next(iter(requirement.specifier)).version)
        for requirement, _ in locked(name)
        if applies(requirement, machine)
    ]
    assert len(found) == len(dict(found)), "markers of two versions hold"
    return dict(found)


def applies(requirement: Requirement, machine: dict[str, str]) -> bool:
    return requirement.marker is None or requirement.marker.evaluate(machine)


@pytest.mark.parametrize("name", ["build", *LOCKED])
def test_each_entry_is_one_version_with_hashes_from_anywhere(name):
    entries = locked(name)
    assert entries
    for requirement, rest in entries:
        (specifier,) = requirement.specifier
        assert specifier.operator == "==", requirement
        assert requirement.url is None
        assert re.fullmatch(r"(--hash=sha256:[0-9a-f]{64}\s*)+", rest), requirement
    text = (ROOT / "maintenance/requirements" / f"{name}.txt").read_text(encoding="utf-8")
    assert "://" not in text
    assert "--index-url" not in text


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine["python_version"])
@pytest.mark.parametrize("name", LOCKED)
def test_the_lock_is_within_the_bounds(name, machine):
    entries = entries_for(name, machine)
    for requirement in wanted([*PROJECT["project"]["dependencies"], *EXTRAS[LOCKED[name]]]):
        if applies(requirement, machine):
            version = entries.get(normal(requirement.name))
            assert version, f"no version of {requirement} for {machine}"
            assert requirement.specifier.contains(version), (requirement, version)


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine["python_version"])
def test_the_lowest_versions_that_are_tested_are_the_lowest_that_are_allowed(machine):
    entries = entries_for("test-lowest", machine)
    for requirement in wanted(PROJECT["project"]["dependencies"]):
        if applies(requirement, machine):
            (lowest,) = (one.version for one in requirement.specifier if one.operator == ">=")
            assert Version(entries[normal(requirement.name)]) == Version(lowest), requirement


def test_packages_are_built_with_what_pyproject_asks_for():
    """uv installs what the other locks name."""
    (entry,) = [entry for entry, _ in locked("build") if entry.name != "uv"]
    (requirement,) = map(Requirement, PROJECT["build-system"]["requires"])
    (specifier,) = entry.specifier
    assert entry.name == requirement.name
    assert requirement.specifier.contains(specifier.version)


def test_dependencies_are_bounded():
    """Below what users install, from both sides; below what only tests need, from below."""
    for requirement in wanted([*PROJECT["project"]["dependencies"], *EXTRAS["ros"]]):
        assert {one.operator for one in requirement.specifier} == {">=", "<"}, requirement
    for extra in EXTRAS:
        for requirement in wanted(EXTRAS[extra]):
            assert ">=" in {one.operator for one in requirement.specifier}, requirement
