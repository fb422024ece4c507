"""The landing page: landing.md with the picture and sections of the README that it names."""

from __future__ import annotations

import re
from pathlib import Path

from maintenance.website.sources import ROOT, moved

PLACE = "index.md"
_PAGE = Path(__file__).parent / "landing.md"
#: A table of two files side by side, as GitHub shows it, and a file in it.
_PAIR = re.compile(r"(?s)<table>.*?</table>")
_FILE = re.compile(r"(?s)<pre[^>]*>\n# (\S+)\n(.*?)</pre>")


def page() -> bytes:
    """Return the landing page."""
    readme = moved("README.md", (ROOT / "README.md").read_text(encoding="utf-8"))
    head, *sections = re.split(r"(?m)^## ", re.sub(r"<!--.*?-->\n\n?", "", readme))
    parts = {"picture": head[head.index("![") :]}
    for section in sections:
        heading, _, text = section.partition("\n")
        parts[heading] = _PAIR.sub(_side_by_side, text)
    text = _PAGE.read_text(encoding="utf-8")
    return re.sub(r"\{\{ (.*) \}\}", lambda name: parts[name[1]].strip(), text).encode("utf-8")


def _side_by_side(pair: re.Match[str]) -> str:
    files = (
        f"<div markdown>\n\n```{name}\n{text}```\n\n</div>" for name, text in _FILE.findall(pair[0])
    )
    return "\n".join(['<div class="pair" markdown>', *files, "</div>"])
