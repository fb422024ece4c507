"""Results as lines for the terminal and as tables for documents."""

import re
from collections.abc import Collection, Iterable
from pathlib import Path

from benchmarks import fields, recordings
from benchmarks.measure import IDLC, Result
from benchmarks.results import REFERENCES, Run, standing

ROOT = Path(__file__).resolve().parents[1]


def amount(seconds: float) -> str:
    """Return a time with three digits and a unit."""
    for unit, factor in (("s", 1), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1:
            return f"{seconds * factor:#.3g}".rstrip(".") + f" {unit}"
    return f"{seconds * 1e6:.2f} µs"


def head(run: Run) -> str:
    versions = ", ".join(f"{library} {version}" for library, version in run.versions.items())
    return f"{run.python}, {run.machine}; {versions}"


def line(result: Result) -> str:
    """Return a line of the terminal's table."""
    rank = standing(result)
    mine = result.times[IDLC]
    ratio = f"{rank.ratio:6.2f}x {rank.peer}" if rank.peer else ""
    others = "; ".join(
        f"{who} {amount(times.median)}" for who, times in result.times.items() if who != IDLC
    )
    spread = f"{amount(mine.low)} to {amount(mine.high)}"
    return (
        f"{rank.verdict:4} {result.group + ': ' + result.name:37} {amount(mine.median):>8} "
        f"({spread:20}) {ratio:23} {rank.said:35} | {others}"
    ).rstrip()


def summary(run: Run) -> str:
    verdicts = [standing(result).verdict for result in run.results]
    return f"{verdicts.count('ok')} goals reached, {verdicts.count('MISS')} missed"


# generated parts of documents


def full_table(run: Run) -> str:
    """Return the tables of all rows except those about recordings and about fields."""
    others = (result for result in run.results if result.group != fields.GROUP)
    results = [result for result in others if not of_recordings(result)]
    return tables(results, REFERENCES, run)


def recordings_table(run: Run) -> str:
    """Return the tables about recordings, with columns for copying and decompression."""
    return tables(filter(of_recordings, run.results), (), run)


def fields_table(run: Run) -> str:
    """Return the table about reading one field, with columns for whole decoding."""
    return table(
        fields.GROUP, (result for result in run.results if result.group == fields.GROUP), ()
    )


def of_recordings(result: Result) -> bool:
    return result.group.startswith(recordings.GROUP)


def tables(results: Iterable[Result], left_out: Collection[str], run: Run) -> str:
    """Return a table for each group; each cell is a multiple of idlc's time."""
    groups: dict[str, list[Result]] = {}
    for result in results:
        groups.setdefault(result.group, []).append(result)
    parts = [table(group, rows, left_out) for group, rows in groups.items()]
    return "\n\n".join([*parts, head(run) + "."])


def table(group: str, rows: Iterable[Result], left_out: Collection[str]) -> str:
    rows = list(rows)
    used = dict.fromkeys(who for row in rows for who in row.times)
    peers = [who for who in used if who not in (IDLC, *left_out)]
    lines = [
        f"| {' | '.join([group, 'idlc (quartiles)', *peers, 'goal'])} |",
        f"|---|{'---:|' * (len(peers) + 1)}---|",
    ]
    for row in rows:
        mine = row.times[IDLC]
        _, _, verdict, goal = standing(row)
        low, high = amount(mine.low), amount(mine.high)
        unit = amount(mine.median).split()[1]
        if unit == low.split()[1] == high.split()[1]:
            low, high = low.split()[0], high.split()[0]
        factors = [
            factor(row.times[who].median / mine.median) if who in row.times else "" for who in peers
        ]
        missed = ", MISS" * (verdict == "MISS")
        cells = [row.name, f"{amount(mine.median)} ({low}–{high})", *factors, goal + missed]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def factor(ratio: float) -> str:
    return f"{ratio:.1f}×" if ratio >= 0.1 else f"{ratio:.2f}×"


#: Each document, and the function for its text between `<!-- benchmarks -->` and `<!-- end -->`.
PARTS = {
    ROOT / "benchmarks" / "performance.md": full_table,
    ROOT / "benchmarks" / "recordings.md": recordings_table,
    ROOT / "benchmarks" / "fields.md": fields_table,
}
PART = re.compile(r"(?<=<!-- benchmarks -->\n).*?(?=<!-- end -->)", re.DOTALL)


def written(path: Path, run: Run) -> str:
    """Return the text of a document with its generated part replaced."""
    text, count = PART.subn(lambda _: PARTS[path](run) + "\n", path.read_text(encoding="utf-8"))
    assert count == 1, path
    return text


def write_documents(run: Run) -> None:
    for path in PARTS:
        path.write_text(written(path, run), encoding="utf-8")
