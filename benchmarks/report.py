"""How results are shown: in the terminal, in README.md and in docs."""

import re
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from benchmarks import recordings
from benchmarks.measure import IDLC, Result
from benchmarks.results import REFERENCES, Run, standing

ROOT = Path(__file__).resolve().parents[1]
#: The groups that README.md shows, one column each, and the messages, one row each.
COLUMNS = ("serialize", "deserialize", "construct", "compare")
ROWS = ("String", "PoseStamped", "JointState(20)", "Image(640x480x3)")


def amount(seconds: float) -> str:
    """Return a time with three digits and a unit."""
    for unit, factor in (("s", 1), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1:
            return f"{seconds * factor:#.3g}".rstrip(".") + f" {unit}"
    return f"{seconds * 1e6:.2f} µs"


def head(run: Run) -> str:
    known = ", ".join(f"{who} {version}" for who, version in run.versions.items())
    return f"{run.python}, {run.machine}; {known}"


def line(result: Result) -> str:
    """Return a line of the terminal's table."""
    found = standing(result)
    mine = result.times[IDLC]
    ratio = f"{found.ratio:6.2f}x {found.peer}" if found.peer else ""
    others = "; ".join(
        f"{who} {amount(times.median)}" for who, times in result.times.items() if who != IDLC
    )
    spread = f"{amount(mine.low)} to {amount(mine.high)}"
    return (
        f"{found.verdict:4} {result.group + ': ' + result.name:37} {amount(mine.median):>8} "
        f"({spread:20}) {ratio:23} {found.said:35} | {others}"
    ).rstrip()


def summary(run: Run) -> str:
    verdicts = [standing(one).verdict for one in run.results]
    return f"{verdicts.count('ok')} goals are reached, {verdicts.count('MISS')} are missed"


# generated parts of documents


def readme_table(run: Run) -> Iterator[str]:
    """Yield one line per message: idlc's time, and how many times the fastest peer's it is."""
    found = {(one.group, one.name): one for one in run.results}
    yield "| | " + " | ".join(COLUMNS) + " |"
    yield "|---|" + "---:|" * len(COLUMNS)
    for name in ROWS:
        cells = [cell(found.get((column, name))) for column in COLUMNS]
        yield f"| {name} | " + " | ".join(cells) + " |"


def cell(result: Result | None) -> str:
    if result is None:
        return ""
    found = standing(result)
    ratio = f", **{found.ratio:.1f}×**" if found.ratio else ""
    return amount(result.times[IDLC].median) + ratio


def readme_part(run: Run) -> str:
    return "\n".join([*readme_table(run), "", head(run) + "."])


def full_table(run: Run) -> str:
    """Return every row but those of recordings, and how many times idlc's time others take."""
    found = [one for one in run.results if not of_recordings(one)]
    return table(found, REFERENCES, run)


def recordings_table(run: Run) -> str:
    """Return the rows of recordings, what nobody can do without among the others."""
    return table(filter(of_recordings, run.results), (), run)


def of_recordings(result: Result) -> bool:
    return result.group.startswith(recordings.GROUP)


def table(found: Iterable[Result], left_out: Collection[str], run: Run) -> str:
    """Return rows, with every implementation's time and how many times idlc's that is."""
    found = list(found)
    used = dict.fromkeys(who for one in found for who in one.times)
    peers = [who for who in used if who not in (IDLC, *left_out)]
    lines = [
        f"| | idlc | quartiles | {' | '.join(peers)} | goal | |",
        "|---|---:|---:|" + "---:|" * len(peers) + "---|---|",
    ]
    for one in found:
        mine, said = one.times[IDLC], standing(one)
        cells = [
            f"{amount(one.times[who].median)}, {one.times[who].median / mine.median:.1f}×"
            if who in one.times
            else ""
            for who in peers
        ]
        spread = f"{amount(mine.low)} to {amount(mine.high)}"
        words = [f"{one.group} {one.name}", amount(mine.median), spread, *cells]
        lines.append("| " + " | ".join([*words, said.said, said.verdict]) + " |")
    return "\n".join([*lines, "", head(run) + "."])


#: A document, and what stands in it between `<!-- benchmarks -->` and `<!-- end -->`.
PARTS = {
    ROOT / "README.md": readme_part,
    ROOT / "docs" / "performance.md": full_table,
    ROOT / "docs" / "recorded-data.md": recordings_table,
}
PART = re.compile(r"(?<=<!-- benchmarks -->\n).*?(?=<!-- end -->)", re.DOTALL)


def written(path: Path, run: Run) -> str:
    """Return the text of a document with its generated part made anew."""
    text, count = PART.subn(lambda _: PARTS[path](run) + "\n", path.read_text(encoding="utf-8"))
    assert count == 1, path
    return text


def write_documents(run: Run) -> None:
    for path in PARTS:
        path.write_text(written(path, run), encoding="utf-8")
