"""What is wrong with a piece of text, before it is known where that stands."""

from __future__ import annotations

import msgspec

from idlc.diagnostics import codes


class Fault(msgspec.Struct, frozen=True):
    """What is wrong with a value; `start` and `end` count from the beginning of its text."""

    code: codes.Code
    message: str
    start: int
    end: int
    hint: str | None = None

    def moved(self, offset: int) -> Fault:
        """Return the same fault in a longer text that has `offset` characters before."""
        return msgspec.structs.replace(self, start=self.start + offset, end=self.end + offset)
