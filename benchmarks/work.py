"""Input shared by groups of rows: generated packages, and each implementation's messages."""

import shutil
from functools import cached_property, lru_cache
from pathlib import Path

from benchmarks.measure import IDLC
from benchmarks.peers import Implementation, generate, implementations

MEMORY = Path("/dev/shm")  # noqa: S108 - folders in it are made by tempfile
#: Bytes that a whole run writes, with room to spare.
ROOM = 1 << 31


def in_memory() -> Path | None:
    """Return where files are in memory, `None` if that is nowhere.

    On a disk, how long it takes to make a file depends on what was there: ext4 takes up to thirty
    times as long for some minutes after others were removed, as it passes over their inodes.
    """
    roomy = MEMORY.is_dir() and shutil.disk_usage(MEMORY).free > ROOM
    return MEMORY if roomy else None


class Work:
    """One run; `quick` asks for the least that still touches everything."""

    def __init__(self, folder: Path, quick: bool) -> None:
        self.folder = folder
        self.quick = quick
        self.message = lru_cache(maxsize=None)(self._message)
        self.raw = lru_cache(maxsize=None)(self._raw)

    @cached_property
    def generated(self) -> Path:
        """The folder of the packages that idlc generated."""
        return generate(self.folder / "generated")

    @cached_property
    def implementations(self) -> dict[str, Implementation]:
        return implementations(self.generated)

    def _raw(self, row: str) -> bytes:
        """Return the row's message as CDR."""
        return self.message(IDLC, row).serialize()

    def _message(self, who: str, row: str) -> object | None:
        """Return the row's message of an implementation, `None` if it does not have the type."""
        raw = b"" if who == IDLC else self.raw(row)
        return self.implementations[who].message(row, raw)

    def check_bytes(self, who: str, row: str, written: bytes) -> None:
        """Fail unless an implementation wrote this row's message."""
        raw = self.raw(row)
        if who == "rclpy":  # leaves garbage in padding and after the message
            kind = type(self.message(IDLC, row))
            assert kind.deserialize(written).serialize() == raw, (who, row)
        else:
            assert bytes(written) == raw, (who, row)
