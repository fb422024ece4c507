"""The declarations of a package.xml, as the `[project]` table of a pyproject.toml."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError
from idlc.model.names import why_not_package
from idlc.project.lock import Runtime
from idlc.project.package_xml import Statement, declared_name, read_statements
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import SETTINGS_FILE, toml
from idlc.version import RUNTIME

#: The packages on PyPI that every generated package needs. The packages of ROS 2 that it imports
#: are not among them: ROS 2 installs them, and anybody could register `std-msgs` there.
DEPENDENCIES = ("numpy",)
PYTHON = ">=3.10"
_VERSION = re.compile(r"\d+\.\d+\.\d+", re.ASCII)
_ADDRESS = re.compile(r"[\w.+-]+@[\w-]+(\.[\w-]+)*", re.ASCII)
_URLS = {"website": "Homepage", "repository": "Repository", "bugtracker": "Issues"}
_READMES = ("README.md", "README.rst", "README.txt")


def project(runtime: Runtime | None, report: Report) -> dict[str, Any]:
    """Return the table by the working folder's package.xml. Raises ReportedError."""
    root = Root.here()
    name = declared_name(root.base / MANIFEST, root, report)
    if name is None:
        raise ReportedError
    if why := why_not_package(name):
        hint = "change `<name>`, and its uses in other packages"
        raise report.refused(codes.UNIMPORTABLE_PACKAGE.of(MANIFEST, f"`{name}` {why}", hint=hint))
    statements = read_statements(root.base / MANIFEST, MANIFEST, root, report)
    report.raise_errors()
    version = _version(statements, report)
    table = {
        "name": name,
        "version": version,
        "description": next(iter(_texts(statements, "description")), ""),
        "readme": next(filter(lambda readme: Path(readme).is_file(), _READMES), None),
        "requires-python": PYTHON,
        "license": _license(_texts(statements, "license")),
        "authors": _people(statements, "author"),
        "maintainers": _people(statements, "maintainer"),
        "urls": _urls(statements),
        "dependencies": [*DEPENDENCIES, *((RUNTIME,) if runtime == "installed" else ())],
    }
    return {key: value for key, value in table.items() if value}


def _texts(statements: Iterable[Statement], tag: str) -> list[str]:
    """Return the texts of all statements with a tag, each on one line."""
    texts = (" ".join(statement.text.split()) for statement in statements if statement.tag == tag)
    return list(dict.fromkeys(filter(None, texts)))


def _version(statements: Iterable[Statement], report: Report) -> str:
    """Return the version; report IDL610 if there is none, or one that ROS 2 does not know."""
    hint = "write three numbers, as in `<version>0.1.0</version>`"
    for statement in statements:
        if statement.tag == "version":
            if _VERSION.fullmatch(statement.text):
                return statement.text
            message = f"`{statement.text}` is not a version of a ROS 2 package"
            raise report.refused(codes.BAD_PACKAGE_XML.at(statement.span, message, hint=hint))
    raise report.refused(codes.BAD_PACKAGE_XML.of(MANIFEST, "no version in this file", hint=hint))


def _license(names: Sequence[str]) -> str | dict[str, str] | None:
    """Return the licences, all of which hold, as an SPDX expression, or else as plain text."""
    from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

    parts = [f"({name})" if len(names) > 1 and " " in name else name for name in names]
    try:
        return canonicalize_license_expression(" AND ".join(parts)) if names else None
    except InvalidLicenseExpression:
        return {"text": ", ".join(names)}


def _people(statements: Iterable[Statement], tag: str) -> list[dict[str, str]]:
    """Return people; an address that mail programs would reject is left out."""
    people = []
    for statement in statements:
        if statement.tag == tag:
            address = statement.attributes.get("email", "").strip()
            email = address if _ADDRESS.fullmatch(address) else ""
            person = {"name": " ".join(statement.text.split()), "email": email}
            people.append({key: value for key, value in person.items() if value})
    return list(filter(None, people))


def _urls(statements: Iterable[Statement]) -> dict[str, str]:
    """Return the first address of each kind."""
    urls: dict[str, str] = {}
    for statement in statements:
        label = _URLS.get(statement.attributes.get("type", "website"))
        if statement.tag == "url" and label and len(statement.text.split()) == 1:
            urls.setdefault(label, statement.text)
    return urls


def complete_table(declared: dict[str, Any], report: Report) -> dict[str, Any]:
    """Return the table with what package.xml declares in place of what is absent or dynamic.

    Without a table all of it is taken. With one, as the standard demands, only the fields that
    `dynamic` names are taken.
    """
    path = Path(SETTINGS_FILE)
    document = toml(path.read_text(encoding="utf-8")) if path.is_file() else {}
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
            message = f"`dynamic` in [project] names `{key}`, which package.xml does not contain"
            hint = f"it can name {', '.join(f'`{name}`' for name in _DYNAMIC)}"
            report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint=hint))
        elif key in table:
            message = f"`{key}` is both in [project] and in its `dynamic`"
            report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint="remove one of them"))
    taken = {key: declared[key] for key in dynamic if key in declared}
    return {**table, **taken, "dynamic": []}


#: Fields that package.xml, and files beside it, can provide.
_DYNAMIC = (
    *("version", "description", "readme", "requires-python", "license"),
    *("authors", "maintainers", "urls", "dependencies"),
)
