"""Definitions that no recorder writes: mutations that know lines, words and delimiters."""

from __future__ import annotations

import random
import re

LINE = "=" * 80
DELIMITERS = [
    *(LINE + "\n", LINE + "=\n", LINE[1:] + "\n", LINE + "\r\n", LINE + " \t\n", LINE),
    *(f"{LINE}\nMSG: {one}\n" for one in ("a/B", "a/msg/B", "../x/Y", "", "a/b/c/D", "A/b", "a/É")),
    *(f"{LINE}\n{one}: std_msgs/Header\n" for one in ("IDL", "SRV", "ACTION", "XML", "msg")),
]
NUMBERS = "0 1 -1 255 256 1e999 0x7fffffffffffffff 4294967296 99999999999999999999 1.5 .5".split()
MSG_WORDS = [
    *("int8 int32 uint64 float64 string wstring bool byte char time duration octet".split()),
    *("std_msgs/Header std_msgs/msg/Header Imu Header sensor_msgs/Imu a/b/c/D".split()),
    *("[] [3] [<=3] [0] [<=0] [4294967296] [][] <=3 <=99999999999 = # --- @optional @key".split()),
    *('"a" \'a\' "\\x41" "\\ud800" "\\N{DIGIT ONE}" [1,2] ["a","b"] a A __class__ é \0'.split()),
]
IDL_WORDS = [
    *("module struct union enum bitmask typedef const sequence string wstring interface".split()),
    *("int8 long double octet char wchar boolean any map @verbatim @default @unit @key".split()),
    *('{ } ( ) < > [ ] ; :: : , = # ## "a" \'a\' L"a" "\\"" // /* */ \0 é a__b'.split()),
    *('#include <a.h> @default(value=1) (language="comment",text="a") << ~ TRUE -'.split()),
]
_PIECES = re.compile(r"\w+|\s+|.", re.DOTALL)


def mutated(text: str, rng: random.Random, *, idl: bool) -> str:
    """Return a definition with few changes."""
    words = IDL_WORDS if idl else MSG_WORDS
    for _ in range(rng.choice([1, 1, 2, 3, 6])):
        change = rng.choice([_word, _word, _word, _line, _delimiter, _nest])
        text = change(text, rng, words)[:200_000]
    return text


def _word(text: str, rng: random.Random, words: list[str]) -> str:
    """Replace, add, remove or move a word."""
    pieces = _PIECES.findall(text)
    at = rng.randrange(len(pieces) + 1)
    new = rng.choice([*words, *NUMBERS, *pieces[:50]] if pieces else words)
    match rng.randrange(4):
        case 0:
            pieces[at : at + 1] = [new]
        case 1:
            pieces[at:at] = [" ", new, " "]
        case 2:
            del pieces[at : at + rng.choice([1, 1, 5, 50])]
        case _:
            other = rng.randrange(len(pieces) + 1)
            pieces[at:at] = pieces[other : other + rng.randrange(20)]
    return "".join(pieces)


def _line(text: str, rng: random.Random, _words: list[str]) -> str:
    """Repeat, remove, move or lengthen a line, or end all lines in another way."""
    lines = text.splitlines(keepends=True) or [""]
    at = rng.randrange(len(lines))
    match rng.randrange(5):
        case 0:
            lines[at:at] = [lines[at]] * rng.choice([1, 2, 200])
        case 1:
            del lines[at]
        case 2:
            lines.insert(rng.randrange(len(lines)), lines.pop(at))
        case 3:
            lines[at] = lines[at].rstrip("\n") * rng.choice([2, 50]) + "\n"
        case _:
            end = rng.choice(["\r\n", "\r", "\n\n", "\x85", "\u2028", "\x0b", ""])
            return text.replace("\n", end)
    return "".join(lines)


def _delimiter(text: str, rng: random.Random, _words: list[str]) -> str:
    """Put a delimiter anywhere, or in place of another."""
    new = rng.choice(DELIMITERS)
    if LINE in text and rng.random() < 0.5:
        return text.replace(LINE + "\n", new, 1)
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice(["", "\n"]) + new + text[at:]


def _nest(text: str, rng: random.Random, words: list[str]) -> str:
    """Repeat a word so often that what calls itself for each would not return."""
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice(words) * rng.choice([5, 300, 3000]) + text[at:]
