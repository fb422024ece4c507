"""What is thrown at idlc: a target for each thing that it reads, seeds, and ways to mutate them.

A target takes bytes and a folder of its own. It returns on every input, or idlc has a bug.
Inputs that once found one are in tests/hardening/corpus/TARGET/ and are tried first, always.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import random
from collections.abc import Callable, Iterator
from pathlib import Path

from idlc.cli.main import main
from idlc.project.lock import FILE
from tests.support import fuzzing_edits as edits
from tests.support.fuzzing_recordings import everything, recorded
from tests.support.paths import ROOT, VERDICTS

CORPUS = ROOT / "tests/hardening/corpus"
#: What to put in: where parsers are cut, and numbers that are too large.
WORDS = [
    *(b"#", b"=", b'"', b"'", b"[", b"]", b"<=", b" ", b"\t", b"\\", b"\n", b"\r\n", b"---", b"/"),
    *(b"\0", b"\xff", b"\xc3\xa9", b"\xe2\x80\xa8", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\x85"),
    *(b"99999999999999999999", b"-1", b"1e999", b"0x", b"{", b"}", b"null", b'":', b"..", b"&x;"),
    *(
        b"string<=3",
        b"int32[<=2]",
        b"std_msgs/Header",
        b"wstring",
        b"A",
        b"a",
        b"_",
        b",",
        b"<",
        b">",
    ),
]


def idlc(*words: str) -> int:
    """Run idlc and return its status; a bug of idlc's own is one here, too."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        status = main(words)
    said = out.getvalue()
    assert status in (0, 1, 2), said[-2000:]
    assert "error[IDL901]" not in said, said[-2000:]
    return status


def interface(data: bytes, folder: Path, kind: str) -> None:
    """A file is judged, laid out, hashed, compared and compiled, or refused; and that agrees."""
    path = folder / kind / f"A.{kind}"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    here = str(folder)
    named = ("--package", "demo")
    verdict = idlc("check", here, *named)
    assert idlc("gen", here, "-o", f"{here}/out/demo", *named) == verdict
    assert idlc("show", here, *named, "--format", "hash") == verdict
    assert idlc("breaking", here, "--against", here, *named) == verdict
    idlc("fmt", here)
    assert idlc("check", here, *named) == verdict
    assert verdict or not idlc("fmt", "--check", here)
    assert verdict or not idlc("gen", here, "-o", f"{here}/out/demo", *named)


def msg(data: bytes, folder: Path) -> None:
    interface(data, folder, "msg")


def srv(data: bytes, folder: Path) -> None:
    interface(data, folder, "srv")


def action(data: bytes, folder: Path) -> None:
    interface(data, folder, "action")


def package(folder: Path) -> Path:
    path = folder / "pkg" / "msg" / "A.msg"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("std_msgs/Header header\nint8 a\n", encoding="utf-8")
    return folder / "pkg"


def lock(data: bytes, folder: Path) -> None:
    """A lock of unknown origin makes idlc neither fail nor touch what lies outside its folder."""
    precious = folder / "precious.py"
    precious.write_text("mine\n", encoding="utf-8")
    here = str(package(folder))
    out = folder / "out" / "demo"
    out.mkdir(parents=True, exist_ok=True)
    (out / "mine.py").write_text("mine\n", encoding="utf-8")
    (out / FILE).write_bytes(data)
    idlc("gen", here, "-o", str(out), "--check")
    idlc("gen", here, "-o", str(out))
    idlc("breaking", here, "--against", str(out / FILE))
    idlc("gen", here, "-o", str(out), "--force")
    assert precious.read_text(encoding="utf-8") == "mine\n"
    kept = [path.read_text(encoding="utf-8") for path in out.glob("mine.py*")]
    assert "mine\n" in kept or hashlib.sha256(b"mine\n").hexdigest().encode() in data


def pyproject(data: bytes, folder: Path) -> None:
    """Settings of unknown origin are taken or refused."""
    here = package(folder)
    (here / "pyproject.toml").write_bytes(data)
    before = Path.cwd()
    os.chdir(here)
    try:
        idlc("check")
        idlc("breaking")
        idlc("fmt", "--check")
    finally:
        os.chdir(before)


def package_xml(data: bytes, folder: Path) -> None:
    """A package.xml of unknown origin is read or refused."""
    here = package(folder)
    (here / "package.xml").write_bytes(data)
    idlc("check", str(here))
    idlc("breaking", str(here), "--against", str(here))
    idlc("gen", str(here), "-o", str(folder / "out" / "demo"), "--check")


def definition(data: bytes, folder: Path) -> None:
    """What a recording says of a type is believed or refused."""
    everything(idlc, recorded(data, folder, "ros2msg"), folder)


def idl_definition(data: bytes, folder: Path) -> None:
    """So is IDL."""
    everything(idlc, recorded(data, folder, "ros2idl"), folder)


def mcap(data: bytes, folder: Path) -> None:
    """A recording is read or refused."""
    path = folder / "demo.mcap"
    path.write_bytes(data)
    everything(idlc, path, folder)


def db3(data: bytes, folder: Path) -> None:
    """So is a database."""
    path = folder / "demo.db3"
    path.write_bytes(data)
    everything(idlc, path, folder)


TARGETS: dict[str, Callable[[bytes, Path], None]] = {
    function.__name__: function
    for function in (
        *(msg, srv, action, lock, pyproject, package_xml),
        *(definition, idl_definition, mcap, db3),
        *(edits.manifest, edits.setup_file, edits.setup_cfg, edits.launch_file),
    )
}


def saved(target: str) -> list[bytes]:
    """Return the inputs that are tried always."""
    return [path.read_bytes() for path in sorted((CORPUS / target).glob("*"))]


def seeds(target: str) -> list[bytes]:
    """Return sound inputs to mutate."""
    found = saved(target)
    if target in ("msg", "srv", "action"):
        recorded = VERDICTS
        for line in recorded.read_text(encoding="utf-8").splitlines():
            case = json.loads(line)
            if case["kind"] == target and "text" in case:
                found.append(case["text"].encode("utf-8", "surrogatepass"))
    return found


def mutated(data: bytes, rng: random.Random, others: list[bytes]) -> bytes:
    """Return an input with a few changes."""
    raw = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 3, 8])):
        at = rng.randrange(len(raw) + 1)
        match rng.randrange(7):
            case 0:
                raw[at : at + rng.randrange(1, 4)] = b""
            case 1:
                raw[at:at] = rng.choice(WORDS)
            case 2:
                raw[at : at + 1] = rng.choice(WORDS)
            case 3:
                raw[at : at + 1] = bytes([rng.randrange(256)])
            case 4:
                lines = raw.splitlines(keepends=True)
                rng.shuffle(lines)
                raw = bytearray(b"".join(lines))
            case 5:
                other = rng.choice(others)
                raw[at:at] = other[rng.randrange(len(other) + 1) :][: rng.randrange(1, 60)]
            case _:
                raw[at:at] = raw[rng.randrange(len(raw) + 1) :][: rng.randrange(1, 60)]
    return bytes(raw)


def inputs(target: str, seed: int, count: int) -> Iterator[bytes]:
    """Yield mutated seeds, the same ones for the same seed."""
    rng = random.Random(f"{target} {seed}")
    sound = seeds(target)
    for _ in range(count):
        yield mutated(rng.choice(sound), rng, sound)


def keep(target: str, data: bytes) -> Path:
    """Save an input that found a bug, and return its path."""
    path = CORPUS / target / hashlib.sha256(data).hexdigest()[:16]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path
