"""What a package.xml says of a package, as the `[project]` table of a pyproject.toml."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from idlc.checks.package.facts import Statement
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.disk.packages.enclosing import MANIFEST, declared_name, statements
from idlc.emit.package_name import why_not_package

#: What every generated package needs of others on PyPI. The packages of ROS 2 that it imports are
#: no such names: who has ROS 2 has them, and `std-msgs` may be anybody's there.
DEPENDENCIES = ("numpy",)
PYTHON = ">=3.10"
_VERSION = re.compile(r"\d+\.\d+\.\d+", re.ASCII)
_ADDRESS = re.compile(r"[\w.+-]+@[\w-]+(\.[\w-]+)*", re.ASCII)
_URLS = {"website": "Homepage", "repository": "Repository", "bugtracker": "Issues"}
_READMES = ("README.md", "README.rst", "README.txt")


def project(report: Report) -> dict[str, Any]:
    """Return what the working folder's package.xml gives; empty after a problem."""
    path = Path(MANIFEST)
    name = declared_name(path, MANIFEST, report)
    if name is None:
        return {}
    if why := why_not_package(name):
        hint = "change `<name>`, and its uses in other packages"
        report.add(codes.UNIMPORTABLE_PACKAGE.of(MANIFEST, f"`{name}` {why}", hint=hint))
        return {}
    said = statements(path, MANIFEST, report)
    version = None if report.had_errors else _version(said, report)
    if version is None:
        return {}
    found = {
        "name": name,
        "version": version,
        "description": next(iter(_texts(said, "description")), ""),
        "readme": next(filter(lambda readme: Path(readme).is_file(), _READMES), None),
        "requires-python": PYTHON,
        "license": _license(_texts(said, "license")),
        "authors": _people(said, "author"),
        "maintainers": _people(said, "maintainer"),
        "urls": _urls(said),
        "dependencies": list(DEPENDENCIES),
    }
    return {key: value for key, value in found.items() if value}


def _texts(said: Iterable[Statement], tag: str) -> list[str]:
    """Return the texts of all statements with a tag, each on one line."""
    texts = (" ".join(one.text.split()) for one in said if one.tag == tag)
    return list(dict.fromkeys(filter(None, texts)))


def _version(said: Iterable[Statement], report: Report) -> str | None:
    """Return the version; report IDL610 if there is none, or one that ROS 2 does not know."""
    hint = "it is three numbers, as in `<version>0.1.0</version>`"
    for one in said:
        if one.tag == "version":
            if _VERSION.fullmatch(one.text):
                return one.text
            message = f"`{one.text}` is no version of a ROS 2 package"
            report.add(codes.BAD_PACKAGE_XML.at(one.span, message, hint=hint))
            return None
    report.add(codes.BAD_PACKAGE_XML.of(MANIFEST, "no version in this file", hint=hint))
    return None


def _license(names: Sequence[str]) -> str | dict[str, str] | None:
    """Return the licences, all of which hold, as an SPDX expression, or else as plain text."""
    from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

    parts = [f"({name})" if len(names) > 1 and " " in name else name for name in names]
    try:
        return canonicalize_license_expression(" AND ".join(parts)) if names else None
    except InvalidLicenseExpression:
        return {"text": ", ".join(names)}


def _people(said: Iterable[Statement], tag: str) -> list[dict[str, str]]:
    """Return people; an address that mail programs would not take is left out."""
    found = []
    for one in said:
        if one.tag == tag:
            address = one.attributes.get("email", "").strip()
            email = address if _ADDRESS.fullmatch(address) else ""
            person = {"name": " ".join(one.text.split()), "email": email}
            found.append({key: value for key, value in person.items() if value})
    return list(filter(None, found))


def _urls(said: Iterable[Statement]) -> dict[str, str]:
    """Return the first address of each kind."""
    found: dict[str, str] = {}
    for one in said:
        label = _URLS.get(one.attributes.get("type", "website"))
        if one.tag == "url" and label and len(one.text.split()) == 1:
            found.setdefault(label, one.text)
    return found
