"""Check workflows and forms of GitHub against its schemas and with zizmor."""

from __future__ import annotations

import re
import sys
from pathlib import Path

from maintenance.release.project import FailedError, Project, run

#: Patterns of files, and the schema of check-jsonschema that each is held to.
SCHEMAS = {
    ".github/workflows/*.yml": "vendor.github-workflows",
    ".github/ISSUE_TEMPLATE/[!c]*.yml": "vendor.github-issue-forms",
    ".github/ISSUE_TEMPLATE/config.yml": "vendor.github-issue-config",
    ".github/dependabot.yml": "vendor.dependabot",
    "action.yml": "vendor.github-actions",
    "CITATION.cff": "vendor.citation-file-format",
}
_PINNED = re.compile(r"[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+")


def fit_their_schemas(project: Project) -> None:
    """Each file has the form that its reader expects."""
    for pattern, schema in SCHEMAS.items():
        files = sorted(project.root.glob(pattern))
        if not files:
            raise FailedError(f"there is no {pattern}")
        words = ("-m", "check_jsonschema", "--builtin-schema", schema, *files)
        run(sys.executable, *words, cwd=project.root)


def are_safe(project: Project) -> None:
    """zizmor, without network, finds nothing in workflows and the action."""
    tool = Path(sys.executable).parent / "zizmor"
    run(tool, "--offline", "--no-progress", "--strict-collection", ".", cwd=project.root)


def name_actions_by_hash(project: Project) -> None:
    """Actions of others are named by a commit, with the version that it has."""
    for path in (*project.root.glob(".github/workflows/*.yml"), project.root / "action.yml"):
        for used in re.findall(r"(?m)^\s*-? *uses: (.*)$", path.read_text(encoding="utf-8")):
            if not used.startswith("./") and not _PINNED.fullmatch(used):
                raise FailedError(f"{path.name} uses {used}")
