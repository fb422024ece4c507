"""The `[project]` table of a package: what pyproject.toml says, and package.xml besides."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.disk.settings.pyproject import FILE

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def completed(declared: dict[str, Any], report: Report) -> dict[str, Any]:
    """Return the table with what package.xml declares in place of what is absent or dynamic.

    Without a table all of it is taken. With one it is what the standard demands: the table alone
    says what holds, and `dynamic` names what is taken from elsewhere.
    """
    document = tomllib.loads(Path(FILE).read_text(encoding="utf-8")) if Path(FILE).is_file() else {}
    if "project" not in document:
        return declared
    table = document["project"]
    dynamic = table.get("dynamic", []) if isinstance(table, dict) else None
    if not isinstance(dynamic, list) or not all(isinstance(key, str) for key in dynamic):
        message = "`project` must be a table, and `dynamic` in it a list of strings"
        report.add(codes.BAD_CONFIG.of(FILE, message))
        return {}
    for key in dynamic:
        if key not in _DYNAMIC:
            message = f"`dynamic` in [project] names `{key}`, which no package.xml tells"
            hint = f"it may name {', '.join(f'`{known}`' for known in _DYNAMIC)}"
            report.add(codes.BAD_CONFIG.of(FILE, message, hint=hint))
        elif key in table:
            message = f"`{key}` is both in [project] and in its `dynamic`"
            report.add(codes.BAD_CONFIG.of(FILE, message, hint="remove one of them"))
    taken = {key: declared[key] for key in dynamic if key in declared}
    return {**table, **taken, "dynamic": []}


#: What package.xml, and what lies beside it, can tell.
_DYNAMIC = (
    *("version", "description", "readme", "requires-python", "license"),
    *("authors", "maintainers", "urls", "dependencies"),
)
