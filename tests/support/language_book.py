"""The examples of docs/language.md: interface files, and arrows that say what they mean.

A block named ```msg, ```srv or ```action is an interface file, followed by lines that begin with an
arrow. If its lines hold an arrow each, every line is a file of its own. In a block named ```names,
lines are paths of files that are sound but for their names. Files in a block named ```msg lyrical
are read as Lyrical does. A block whose arrows are a hash, or the text that is hashed, is about
these.

Structures are the records of golden/spec, so that one function tells what idlc and rosidl read.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from idlc.check.registry import advise
from idlc.check.select import RuleSelection
from idlc.diagnostics.codes import CODES, STYLE
from idlc.diagnostics.report import Severity
from tests.support import rosidl_view
from tests.support.paths import DOCS

BOOK = DOCS / "language.md"
ARROW = "→ "
#: The least that is right in a file of each kind.
EMPTY = {"msg": "", "srv": "---\n", "action": "---\n---\n"}
SIBLINGS = {"msg/Part.msg": "int32 number\n"}
#: What an arrow can ask for besides the meaning.
ASKED = ("hash ", "hashed ")
DUMMY = "structure_needs_at_least_one_member"

_BLOCK = re.compile(r"^```(msg|srv|action|names)( lyrical)?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_MARKS = {"␉": "\t", "␠": " ", "⏎": "\n"}


class Example(NamedTuple):
    """An interface file as shown, and the arrows after it; `place` tells it from others."""

    place: str
    shown: str
    arrows: tuple[str, ...]
    kind: str = "msg"
    path: str = ""
    inline: bool = False
    distro: str = ""

    @property
    def case(self) -> dict[str, Any]:
        """The file in the words of golden/spec."""
        package, kind, name = "demo", self.kind, "Example"
        text = unmarked(self.shown)
        if self.path:
            package, kind, file = self.path.split("/")
            name, text = file.rpartition(".")[0], EMPTY[kind]
        elif self.inline:
            text = text + "\n"
        data = text.encode("utf-8", "surrogatepass").hex()
        return {
            "pkg": package,
            "kind": kind,
            "name": name,
            "bytes_hex": data,
            "siblings": SIBLINGS,
            **({"distro": self.distro} if self.distro else {}),
        }


def unmarked(shown: str) -> str:
    """Return a text with what its marks for invisible characters stand for."""
    text = re.sub(r"⟨U\+([0-9A-F]+)⟩", lambda found: chr(int(found[1], 16)), shown)
    return text.translate(str.maketrans(_MARKS))


def examples(book: str) -> Iterator[Example]:
    for block in _BLOCK.finditer(book):
        number = book.count("\n", 0, block.start()) + 2
        lines, distro = block[3].splitlines(), (block[2] or "").strip()
        if any(ARROW in line[1:] for line in lines):
            for example in _inline(block[1], lines, number):
                yield example._replace(distro=distro)
        else:
            code = [line for line in lines if not line.startswith(ARROW)]
            arrows = tuple(line[len(ARROW) :] for line in lines if line.startswith(ARROW))
            shown = "".join(f"{line}\n" for line in code)
            yield Example(f"line {number}", shown, arrows, block[1], distro=distro)


def _inline(kind: str, lines: list[str], number: int) -> Iterator[Example]:
    for count, line in enumerate(lines):
        code, _, said = line.partition(f" {ARROW}")
        path = code.rstrip() if kind == "names" else ""
        yield Example(f"line {number + count}", code.rstrip(), (said,), kind, path, inline=True)


def idl_shown(book: str) -> tuple[Example, str]:
    """Return the example whose .idl file is shown, and that file's text."""
    before, _, after = book.partition("\n```idl\n")
    return list(examples(before))[-1], after.partition("```")[0]


def idl_text(text: str) -> str:
    """Return an .idl file without its head and blank lines."""
    return "".join(f"{line}\n" for line in text.splitlines() if line and line[:2] != "//")


def rewritten(book: str, found: dict[str, tuple[str, ...]]) -> str:
    """Return the book with arrows as they were found, each example given by its place."""
    known = {example.place: example for example in examples(book)}

    def block(match: re.Match[str]) -> str:
        number = match.string.count("\n", 0, match.start()) + 2
        example = known.get(f"line {number}")
        if example is None:
            return match[0]
        if not example.inline:
            arrows = "".join(f"{ARROW}{line}\n" for line in found[example.place])
            return f"```{match[1]}{match[2] or ''}\n{example.shown}{arrows}```"
        rows = [known[f"line {number + n}"] for n in range(match[3].count("\n"))]
        width = min(max(len(row.shown) for row in rows), 44)
        lines = [f"{row.shown:{width}} {ARROW}{found[row.place][0]}\n" for row in rows]
        return f"```{match[1]}{match[2] or ''}\n{''.join(lines)}```"

    return _BLOCK.sub(block, book)


def meaning(structures: list[dict[str, Any]], *, brief: bool) -> list[str]:
    """Return what was read, a line for each thing; `brief` leaves out a lone dummy member."""
    lines = []
    for structure in structures:
        lines += _structure(structure, brief=brief and bool(structure["constants"]))
    return lines


def _structure(structure: dict[str, Any], *, brief: bool) -> Iterator[str]:
    section = structure["name"].rpartition("_")[2]
    head = "" if section == structure["name"] else f"{section}: "
    if structure["comment"]:
        yield f"{head}{_comment(structure['comment'])}"
    for constant in structure["constants"]:
        text = f"{constant['type']} {constant['name']} = {constant['value']!r}"
        yield head + ", ".join((text, *filter(None, [_comment(constant["comment"])])))
    for member in structure["members"]:
        if not (brief and member["name"] == DUMMY):
            yield head + ", ".join(_member(member))


def _member(member: dict[str, Any]) -> Iterator[str]:
    type_ = member["type"]
    yield f"{type_} {member['name']}"
    if "default" in member:
        value = member["default"]
        # the default of an array is a text: that of a Python tuple
        many = type_.endswith("]") or type_.startswith("sequence")
        yield f"default {value if many else repr(value)}"
    if "unit" in member:
        yield f"unit {member['unit']!r}"
    if member["comment"]:
        yield _comment(member["comment"])


def _comment(lines: list[str]) -> str:
    return f"comment {' / '.join(map(repr, lines))}" if lines else ""


def spoken(example: Example, structures: list[dict[str, Any]]) -> tuple[str, ...]:
    """Return the arrows for an accepted file."""
    lines = meaning(structures, brief=example.inline)
    return ("; ".join(lines),) if example.inline else tuple(lines)


def told_by_idlc(example: Example) -> tuple[str, ...]:
    """Return the arrows that an example deserves."""
    model, report = rosidl_view.compile_case(example.case)
    if model is None or report.had_errors:
        wrong = [found for found in report if found.severity is Severity.ERROR]
        return (f"rejected, {_codes(found.code for found in wrong) or 'not UTF-8'}",)
    name = next(iter(model.interfaces))
    asked = {arrow.partition(" ")[0] + " " for arrow in example.arrows} & set(ASKED)
    if asked:
        return tuple(_answer(model, str(name), word) for word in ASKED if word in asked)
    advise(model, report)
    warned = _codes(found.code for found in report if _is_shown(found.code))
    lines = spoken(example, rosidl_view.view(example.case)["parsed"])
    if not example.inline:
        return (*lines, f"warns {warned}") if warned else lines
    said = "accepted" if example.path else lines[0]
    return (f"{said}; warns {warned}",) if warned else (said,)


def _is_shown(code: str) -> bool:
    return RuleSelection().has(CODES[code]) and CODES[code].category != STYLE


def _codes(codes: Any) -> str:
    return ", ".join(f"{code} {CODES[code].slug}" for code in dict.fromkeys(codes))


def _answer(model: Any, name: str, word: str) -> str:
    if word == "hash ":
        return f"hash {model.describer.hash(name)}"
    text = _hashed_text(model.describer.description(name))
    digits = hashlib.sha256(text.encode("ascii")).hexdigest()
    assert model.describer.hash(name) == f"RIHS01_{digits}"
    return f"hashed {text}"


def _hashed_text(description: Any) -> str:
    """Return what is hashed, made as the book says."""
    plain = json.loads(json.dumps(description))
    for one in (plain["type_description"], *plain["referenced_type_descriptions"]):
        for field in one["fields"]:
            del field["default_value"]
    return json.dumps(plain)


def told_by_rosidl(example: Example, outcome: dict[str, Any]) -> tuple[str, ...]:
    """Return the arrows that an outcome of rosidl deserves, without codes of idlc."""
    if outcome["stage"] is not None:
        return ("rejected",)
    if any(arrow.startswith(ASKED) for arrow in example.arrows):
        return (f"hash {outcome['hash']}",)
    if example.path:
        return ("accepted",)
    return spoken(example, rosidl_view.without_repeated_constants(outcome["parsed"]))


def without_codes(example: Example) -> tuple[str, ...]:
    """Return the arrows of an example without what idlc alone says."""
    arrows = (re.sub(r"^(rejected), .*|;? ?warns IDL.*", r"\1", line) for line in example.arrows)
    return tuple(line for line in arrows if line and not line.startswith("hashed "))
