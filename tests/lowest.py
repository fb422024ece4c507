"""Print the lowest versions that pyproject.toml allows: lowest.py EXTRA, as pip requirements.

What other programs check (type checkers, linters, builders) is left to pip; what idlc imports, and
the libraries that its tests compare with, are pinned.
"""

import re
import sys
from pathlib import Path

try:
    import tomllib
except ImportError:
    import tomli as tomllib

PROGRAMS = {"basedpyright", "build", "mypy", "pre-commit", "ruff"}


def lowest(requirements):
    """Yield NAME==VERSION for each requirement with a lower bound."""
    for requirement in requirements:
        found = re.match(r"([A-Za-z0-9-]+)>=([0-9.]+)[^;]*(;.*)?$", requirement)
        if found and found[1] not in PROGRAMS:
            yield f"{found[1]}=={found[2]}{found[3] or ''}"


if __name__ == "__main__":
    text = (Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    project = tomllib.loads(text)["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"][sys.argv[1]]]
    print("\n".join(lowest(wanted)))
