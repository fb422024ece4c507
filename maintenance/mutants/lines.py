"""Which tests execute which lines of idlc, as `plugin` recorded it."""

from __future__ import annotations

import hashlib
import sqlite3
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

#: The context of lines that run outside of all tests, for example while a module is imported.
OUTSIDE = "outside"


def key(test: str) -> str:
    """Return the name of a test's context, which any environment can hold."""
    return hashlib.sha256(test.encode(errors="surrogatepass")).hexdigest()[:16]


class Lines:
    """The record that `--lines FOLDER` wrote."""

    def __init__(self, folder: Path, root: Path) -> None:
        #: for each file of idlc and each context, a number with a bit for each executed line
        self.files: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
        for path in sorted(folder.glob("data.*")):
            for file, context, bits in rows(path):
                name = name_in_idlc(file, root)
                if name is not None:
                    self.files[name][context] |= bits

    def executed(self, file: str) -> set[int]:
        """Return the lines of a file that run at all."""
        bits = 0
        for each in self.files[file].values():
            bits |= each
        return {line for line in range(bits.bit_length()) if bits >> line & 1}

    def tests_of(self, file: str, line: int) -> set[str]:
        """Return the keys of the tests that execute a line.

        A line of a module's body runs once for all tests of a process: all tests that execute the
        module count as its tests.
        """
        contexts = self.files[file]
        if contexts[""] >> line & 1:
            return set(contexts) - {""}
        return {name for name, bits in contexts.items() if bits >> line & 1}


def rows(path: Path) -> Iterable[tuple[str, str, int]]:
    """Yield file, context and executed lines of a data file of coverage."""
    with sqlite3.connect(path) as database:
        try:
            records = database.execute(
                "select file.path, context.context, line_bits.numbits from line_bits"
                " join file on file.id = file_id join context on context.id = context_id"
            ).fetchall()
        except sqlite3.DatabaseError:  # a program was killed while it wrote
            return
    for file, context, bits in records:
        # a dynamic context stands behind the static one of its process
        test = context.removeprefix(OUTSIDE).removeprefix("|")
        yield file, test, int.from_bytes(bits, "little")


def name_in_idlc(file: str, root: Path) -> str | None:
    """Return the path in the repository of a file that was executed."""
    path = Path(file)
    if path.parent.name == "_idlc":
        return f"idlc/runtime/{path.name}" if (root / "idlc/runtime" / path.name).exists() else None
    return path.relative_to(root).as_posix() if path.is_relative_to(root / "idlc") else None
