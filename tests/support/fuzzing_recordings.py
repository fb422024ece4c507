"""Recordings of unknown origin: their definitions, and their containers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mcap.writer import Writer

Run = Callable[..., int]


def everything(idlc: Run, path: Path, folder: Path) -> None:
    """Do all that can be done with the types of a recording; what is compiled agrees."""
    recording = str(path)
    idlc("check", recording)
    idlc("show", recording)
    idlc("show", recording, "/x")
    idlc("breaking", str(folder), "--against", recording)
    out = str(folder / "out")
    if not idlc("gen", recording, "-o", out):
        assert idlc("gen", recording, "-o", out, "--check") == 0
    inside = {"demo.mcap", "demo.db3", "demo", "out"}
    assert {one.name for one in folder.iterdir()} - inside <= {"msg"}


def recorded(text: bytes, folder: Path, encoding: str, type_: str = "demo/msg/A") -> Path:
    """Write a recording with a definition."""
    path = folder / "demo.mcap"
    (folder / "msg").mkdir()
    (folder / "msg/A.msg").write_text("std_msgs/Header header\nint8 a\n", encoding="utf-8")
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(type_, encoding, text)
        writer.register_channel("/x", "cdr", schema)
        writer.finish()
    return path
