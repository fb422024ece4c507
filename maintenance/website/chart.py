"""The chart of the README: how idlc compares with the fastest alternative, from the kept run."""

from __future__ import annotations

import math

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
    """Return horizontal bars on a logarithmic scale: to the right, idlc is faster."""
    results = {(result.group, result.name): result for result in run.results}
    parts = []
    for number, (key, task) in enumerate(TASKS.items()):
        place = standing(results[key])
        assert place.ratio is not None, key
        length = math.log10(place.ratio) * _DECADE
        faster = place.ratio >= 1
        times = place.ratio if faster else 1 / place.ratio
        number_of_times = f"{times:.{0 if times >= 20 else 1}f}"
        words = f"{number_of_times} times {'faster' if faster else 'slower'} than {place.peer}"
        top = _EDGE + number * _ROW
        fill = 'class="g"' if faster else 'class="y"'
        across = f'x="{_AXIS + min(length, 0):.0f}" width="{max(abs(length), 1):.0f}"'
        parts += [
            f'<text class="t" x="{_EDGE}" y="{top + 14}">{task}: {words}</text>',
            f'<rect {fill} {across} y="{top + 20}" height="14" rx="2"/>',
        ]
    height = 2 * _EDGE + len(TASKS) * _ROW
    return svg(_WIDTH, height, style("15px system-ui, sans-serif"), parts)
