"""Measure idlc against its peers: python -m benchmarks [WORD ...], or `make bench`."""

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks import (
    batches,
    classes,
    codec,
    columns,
    compiling,
    editing,
    fields,
    imports,
    recordings,
    report,
    results,
    starting,
    topics,
)
from benchmarks.measure import Row, measure
from benchmarks.peers import PEERS, installed
from benchmarks.work import Work, in_memory

GROUPS = (
    *(codec, batches, fields, columns, classes, imports),
    *(recordings, compiling, starting, editing, topics),
)


def arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("words", nargs="*", metavar="WORD", help="only rows with one in them")
    parser.add_argument("--quick", action="store_true", help="fewer rounds, less to compile")
    parser.add_argument("--rounds", type=int, metavar="N", help="at most so many rounds")
    parser.add_argument("--list", action="store_true", help="only name the rows")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the run here")
    parser.add_argument(
        "--keep", action="store_true", help="make this the run that the documents show"
    )
    parser.add_argument(
        "--documents", action="store_true", help="only write the documents from the kept run"
    )
    found = parser.parse_args(words)
    if found.quick:
        found.rounds = found.rounds or 5
    if found.keep and (found.words or found.rounds):
        parser.error("only a whole run is kept")
    return found


def selected(work: Work, words: Sequence[str]) -> Iterator[Row]:
    for group in GROUPS:
        for row in group.rows(work):
            title = f"{row.group}: {row.name}".lower()
            if not words or any(word.lower() in title for word in words):
                yield row


def main(words: Sequence[str] | None = None) -> None:
    given = arguments(words)
    if given.documents:
        report.write_documents(results.load())
        return
    run = results.here()
    with tempfile.TemporaryDirectory(prefix="idlc-benchmarks-", dir=in_memory()) as folder:
        rows = selected(Work(Path(folder), given.quick), given.words)
        if given.list:
            print("\n".join(f"{row.group}: {row.name}" for row in rows))
            return
        print(report.head(run))
        missing = [peer for peer in PEERS if not installed(peer)]
        if missing:
            print("not installed, so left out:", ", ".join(missing))
        print("median (quartiles), against the fastest peer; > 1x: idlc is faster", flush=True)
        for row in rows:
            run.results.append(measure(row, given.rounds))
            print(report.line(run.results[-1]), flush=True)
    print(report.summary(run))
    if given.json:
        results.save(run, given.json)
    if given.keep:
        results.save(run, results.KEPT)
        report.write_documents(results.load())  # rounded as the file is


if __name__ == "__main__":
    sys.exit(main())
