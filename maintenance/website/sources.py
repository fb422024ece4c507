"""Documents of the repository → the pages of the site, with their links."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[2]
START = "docs/index.md"
README = "README.md"
#: Where documents outside of docs/ are on the site; the others keep their names, in lower case.
PLACES = {
    START: "contents.md",
    README: "about.md",
    "examples/my_robot_controller/README.md": "tutorial.md",
}
#: The pages of rules, which `maintenance.website.rules` makes.
RULES = "idlc/diagnostics/explain"

_CODE = re.compile(r"(?ms)^ *(```+).*?^ *\1$|`[^`\n]+`")
_LINK = re.compile(r"(?<=\]\()([^)\s#]*)(#[^)\s]*)?(?=\))")


def place(path: str) -> str:
    """Return where a file of the repository is on the site."""
    if path == RULES:
        return "rules/index.md"
    if path.startswith(f"{RULES}/"):
        return f"rules/{path.removeprefix(f'{RULES}/')}"
    if path.startswith("docs/") and path != START:
        return path.removeprefix("docs/")
    if path.endswith(".md"):
        return PLACES.get(path, path.lower())
    return f"files/{path}"


def files() -> dict[str, bytes]:
    """Return by its place every page, and every file that pages link to."""
    found: dict[str, bytes] = {}
    readme = (ROOT / README).read_text(encoding="utf-8")  # its parts are on the home page
    wanted = [START, *(path for path in links(README, readme) if not path.startswith(RULES))]
    seen = set(wanted)
    while wanted:
        path = wanted.pop()
        data = (ROOT / path).read_bytes()
        if path.endswith(".md"):
            text = data.decode("utf-8")
            linked = [target for target in links(path, text) if target not in seen]
            seen.update(linked)
            wanted += (target for target in linked if not target.startswith(RULES))
            data = moved(path, text).encode("utf-8")
        found[place(path)] = data
    return found


def links(path: str, text: str) -> Iterator[str]:
    """Yield the files of the repository that a document links to."""
    for target, _ in _LINK.findall(_CODE.sub("", text)):
        if target and ":" not in target:
            yield _resolved(path, target)


def moved(path: str, text: str) -> str:
    """Return a document with links that hold where its page is."""

    def link(found: re.Match[str]) -> str:
        target, anchor = found[1], found[2] or ""
        if not target or ":" in target:
            return found[0]
        there = place(_resolved(path, target))
        return posixpath.relpath(there, posixpath.dirname(place(path))) + anchor

    return outside_code(text, lambda part: _LINK.sub(link, part))


def outside_code(text: str, change: Callable[[str], str]) -> str:
    """Return a text with all but its code changed."""
    parts, end = [], 0
    for code in _CODE.finditer(text):
        parts += [change(text[end : code.start()]), code[0]]
        end = code.end()
    return "".join([*parts, change(text[end:])])


def navigation(found: Mapping[str, bytes]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the sections of docs/index.md, each with the titles and places of its pages."""
    sections = []
    for section in found[place(START)].decode("utf-8").split("\n## ")[1:]:
        heading, _, text = section.partition("\n")
        entries = re.findall(r"(?<!!)\[([^\]]+)\]\(([^)\s#]+)\)", text)
        titles = {there: title[:1].upper() + title[1:] for title, there in reversed(entries)}
        places = [there for there in reversed(titles) if there in found]
        sections.append((heading, [(titles[there], there) for there in places]))
    return sections


def unsearched(found: Mapping[str, bytes]) -> Iterator[str]:
    """Yield the pages that repeat what others say, or are for people who change idlc."""
    yield from (place(RULES), place("CHANGELOG.md"), place(START))
    yield from (there for _, there in dict(navigation(found))["Contributing"])


def _resolved(path: str, target: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
