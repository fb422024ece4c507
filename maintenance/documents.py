"""`python -m maintenance.documents`: count the pages and words that people write for users.

The words are those of README.md and docs/, without docs/contributing/, which only people who change
idlc read, and without what programs write: the parts after `<!-- commands -->` and
`<!-- benchmarks -->`, and the results after the arrows in docs/language.md.
"""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
_GENERATED = re.compile(r"<!-- (?:commands|benchmarks) -->\n.*?<!-- end -->", re.DOTALL)
_RESULT = re.compile(r"→ .*")


def pages() -> list[Path]:
    """Return README.md and the pages in docs/, those for contributors included."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def words(page: Path) -> int:
    """Return the number of words of a page that no program writes."""
    text = _GENERATED.sub("", page.read_text(encoding="utf-8"))
    return len((_RESULT.sub("", text) if page.name == "language.md" else text).split())


def main() -> None:
    """Print the words of each page, and the sums."""
    counts = {page: words(page) for page in pages()}
    for page, count in counts.items():
        print(f"{count:6} {page.relative_to(ROOT).as_posix()}")
    contributing = sum(counts[page] for page in counts if page.parent.name == "contributing")
    users = sum(counts.values()) - contributing
    print(f"{len(counts)} pages, {users:,} words; docs/contributing/: {contributing:,} words more")


if __name__ == "__main__":
    main()
