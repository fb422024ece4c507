"""What a package.xml says of a package, as the `[project]` table of a pyproject.toml."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.model.names import why_not_package
from idlc.project.package_xml import Statement, declared_name, read_statements
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import SETTINGS_FILE

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
    root = Root.here()
    name = declared_name(root.base / MANIFEST, root, report)
    if name is None:
        return {}
    if why := why_not_package(name):
        hint = "change `<name>`, and its uses in other packages"
        report.add(codes.UNIMPORTABLE_PACKAGE.of(MANIFEST, f"`{name}` {why}", hint=hint))
        return {}
    said = read_statements(root.base / MANIFEST, MANIFEST, root, report)
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


if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def completed(declared: dict[str, Any], report: Report) -> dict[str, Any]:
    """Return the table with what package.xml declares in place of what is absent or dynamic.

    Without a table all of it is taken. With one it is what the standard demands: the table alone
    says what holds, and `dynamic` names what is taken from elsewhere.
    """
    document = (
        tomllib.loads(Path(SETTINGS_FILE).read_text(encoding="utf-8"))
        if Path(SETTINGS_FILE).is_file()
        else {}
    )
    if "project" not in document:
        return declared
    table = document["project"]
    dynamic = table.get("dynamic", []) if isinstance(table, dict) else None
    if not isinstance(dynamic, list) or not all(isinstance(key, str) for key in dynamic):
        message = "`project` must be a table, and `dynamic` in it a list of strings"
        report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message))
        return {}
    for key in dynamic:
        if key not in _DYNAMIC:
            message = f"`dynamic` in [project] names `{key}`, which no package.xml tells"
            hint = f"it may name {', '.join(f'`{known}`' for known in _DYNAMIC)}"
            report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint=hint))
        elif key in table:
            message = f"`{key}` is both in [project] and in its `dynamic`"
            report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint="remove one of them"))
    taken = {key: declared[key] for key in dynamic if key in declared}
    return {**table, **taken, "dynamic": []}


#: What package.xml, and what lies beside it, can tell.
_DYNAMIC = (
    *("version", "description", "readme", "requires-python", "license"),
    *("authors", "maintainers", "urls", "dependencies"),
)
