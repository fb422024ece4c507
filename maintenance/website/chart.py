"""Charts from the kept run: how idlc compares with the fastest alternative, and with itself."""

from __future__ import annotations

import math

from benchmarks import fields
from benchmarks.measure import IDLC
from benchmarks.results import Run, standing
from maintenance.website.pictures import style, svg

#: The rows of the run that are shown, by group and name, and the task in words.
TASKS = {
    ("compile", "against rosidl, a file"): "Compile an interface file",
    ("to_columns", "PoseStamped"): "PoseStamped to columns",
    ("serialize", "PoseStamped"): "Serialize PoseStamped",
    ("deserialize", "PoseStamped"): "Deserialize PoseStamped",
    ("publish + take", "PoseStamped"): "Publish and take PoseStamped",
    ("serialize", "JointState(20)"): "Serialize JointState",
    ("deserialize", "Image(640x480x3)"): "Deserialize Image",
    ("compile", "messages of the catalogue, a file"): "Compile a file, codecs on demand",
    ("compare", "PoseStamped"): "Compare two PoseStamped",
}
_ROW, _EDGE, _AXIS, _DECADE, _WIDTH = 42, 18, 102, 200, 520


def chart(run: Run) -> str:
    """Return a bar for each task, against the fastest alternative."""
    results = {(result.group, result.name): result for result in run.results}
    places = [(task, standing(results[key])) for key, task in TASKS.items()]
    return _bars([(task, place.ratio or 0, place.peer) for task, place in places])


def fields_chart(run: Run) -> str:
    """Return a bar for each field, against decoding the message."""
    rows = [result for result in run.results if result.group == fields.GROUP]
    ratios = [row.times["deserialize"].median / row.times[IDLC].median for row in rows]
    names = [row.name.replace("640x480x3", "VGA") for row in rows]
    return _bars([(name, ratio, "deserialize") for name, ratio in zip(names, ratios, strict=True)])


def _bars(rows: list[tuple[str, float, str | None]]) -> str:
    """Return horizontal bars on a logarithmic scale: to the right, idlc is faster."""
    parts = []
    for number, (task, ratio, peer) in enumerate(rows):
        length = math.log10(ratio) * _DECADE
        faster = ratio >= 1
        times = ratio if faster else 1 / ratio
        number_of_times = f"{times:.{0 if times >= 20 else 1}f}"
        words = f"{number_of_times} times {'faster' if faster else 'slower'} than {peer}"
        top = _EDGE + number * _ROW
        fill = 'class="g"' if faster else 'class="y"'
        across = f'x="{_AXIS + min(length, 0):.0f}" width="{max(abs(length), 1):.0f}"'
        parts += [
            f'<text class="t" x="{_EDGE}" y="{top + 14}">{task}: {words}</text>',
            f'<rect {fill} {across} y="{top + 20}" height="14" rx="2"/>',
        ]
    height = 2 * _EDGE + len(rows) * _ROW
    return svg(_WIDTH, height, style("15px system-ui, sans-serif"), parts)
