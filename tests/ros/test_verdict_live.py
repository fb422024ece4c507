"""idlc and the installed rosidl agree on interface files that nobody wrote.

The seed is fixed, so a disagreement stays until it is fixed. `make fuzz` searches further.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from idlc.model import ir
from tests.support import idl_view, rosidl_view
from tests.support.inventions import Inventor
from tests.support.oddities import Oddities
from tests.support.paths import PROGRAMS, VERDICTS
from tests.support.rounds import FUZZING, SEED, rounds

#: rosidl takes about 0.1 s for each.
FILES = rounds(500) if FUZZING else 500
FAMILIES = {
    "inventions": lambda: Inventor(SEED, known_texts()).cases(FILES * 7 // 10),
    "oddities": lambda: Oddities(SEED).cases(FILES * 3 // 10),
}
#: Each is made in parts, so that several processes can share the work; the files are the same.
PARTS = 20


def known_texts() -> dict[str, list[str]]:
    texts: dict[str, list[str]] = {"msg": [], "srv": [], "action": []}
    for line in VERDICTS.read_text(encoding="utf-8").splitlines():
        case = json.loads(line)
        # rosidl's pattern for constants takes for ever on a long name once it is mutated
        slow = "A" * 20 in case.get("text", "")
        if case["build_verdict"] == "accept" and "text" in case and not slow:
            texts[case["kind"]].append(case["text"])
    return texts


def ask_rosidl(cases: list[dict], folder: Path) -> list[dict]:
    asked, answered = folder / "cases.jsonl", folder / "outcomes.jsonl"
    asked.write_text("".join(json.dumps(case) + "\n" for case in cases), encoding="utf-8")
    command = [sys.executable, str(PROGRAMS / "rosidl_side.py"), str(asked), str(answered)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return [json.loads(line) for line in answered.read_text(encoding="utf-8").splitlines()]


@pytest.mark.parametrize(
    "part", [0, *(pytest.param(part, marks=pytest.mark.long) for part in range(1, PARTS))]
)
@pytest.mark.parametrize("family", FAMILIES)
def test_rosidl_and_idlc_agree_on_invented_files(family, part, tmp_path):
    cases = FAMILIES[family]()[part::PARTS]
    outcomes = ask_rosidl(cases, tmp_path)
    disagreements = []
    for case, outcome in zip(cases, outcomes, strict=True):
        expected = {"build_verdict": "reject"}
        if outcome["stage"] is None:
            structures = rosidl_view.without_repeated_constants(outcome["parsed"])
            expected = {"build_verdict": "accept", "parsed": structures, "hash": outcome["hash"]}
        # through JSON: tuples and lists are one thing there
        found = json.loads(json.dumps(rosidl_view.view(case)))
        if found != expected:
            text = bytes.fromhex(case["bytes_hex"]).decode("utf-8", "replace")
            disagreements.append({"text": text, "idlc": found, "rosidl": outcome})
        elif outcome["stage"] is None:
            # recordings may hold the .idl file instead of the other
            name = ir.TypeName(case["pkg"], case["kind"], case["name"])
            text = rosidl_view.text_of(case)
            assert idl_view.read(outcome["idl"], name) == idl_view.read(text, name), text
    assert disagreements == []


@pytest.mark.parametrize("family", FAMILIES)
def test_invented_files_are_not_too_one_sided_to_show_much(family):
    """A part has too few files to tell; rosidl agrees with idlc on each of them."""
    verdicts = [rosidl_view.view(case)["build_verdict"] for case in FAMILIES[family]()]
    assert len(verdicts) * 0.2 < verdicts.count("accept") < len(verdicts) * 0.8
