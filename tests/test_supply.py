"""What idlc is built from: bounded in pyproject.toml, and fixed to the byte in requirements/."""

import re
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]
LOCKED = ("test-ros", "test-kilted")
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
    for version in ("3.10", "3.11", "3.12", "3.13")
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
    text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
    lines = re.sub(r"(?m)^#.*\n", "", text).replace("\\\n", "").splitlines()
    parts = [re.split(r"\s(?=--)", line, maxsplit=1) for line in lines]
    return [(Requirement(words[0]), words[1] if words[1:] else "") for words in parts]


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
    text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
    assert "://" not in text
    assert "--index-url" not in text


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine["python_version"])
@pytest.mark.parametrize("extra", LOCKED)
def test_the_lock_is_within_the_bounds(extra, machine):
    entries = {normal(r.name): r for r, _ in locked(extra) if applies(r, machine)}
    for requirement in wanted([*PROJECT["project"]["dependencies"], *EXTRAS[extra]]):
        if applies(requirement, machine):
            entry = entries[normal(requirement.name)]
            (specifier,) = entry.specifier
            assert requirement.specifier.contains(specifier.version), (requirement, entry)


def test_packages_are_built_with_what_pyproject_asks_for():
    ((entry, _),) = locked("build")
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
