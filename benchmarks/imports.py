"""Importing message classes in a process of its own, whose start-up does not count.

Each candidate imports those messages of std_msgs that hold no arrays and nothing of other packages.
A time is per message; what comes with the first one (numpy, a run-time library) counts.
"""

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from benchmarks import cyclone
from benchmarks.measure import IDLC, Goal, Row
from benchmarks.peers import PREFIX, installed, run_idlc
from benchmarks.processes import plain_python, run
from benchmarks.work import Work
from idlc.model import catalog

CODE = """
import time
{before}
begin = time.thread_time()
{measured}
print((time.thread_time() - begin) / {count})
"""


def rows(work: Work) -> Iterator[Row]:
    ahead, near = Goal(times=1), Goal(at_most=3, than="empty module")
    yield Row("import", "first message", partial(first, work), ahead, rounds=15)
    yield Row("import", "each further message", partial(further, work), near, rounds=15)
    yield Row("import", "17 messages, each", partial(together, work), ahead, rounds=15)


def first(work: Work):
    return candidates(work, "first", plain_messages()[:1])


def together(work: Work):
    return candidates(work, "together", plain_messages())


def further(work: Work):
    """Return candidates that import all messages but the first; peers have one module of all."""
    folder = work.folder / "further"
    folder.mkdir(exist_ok=True)
    first, *others = plain_messages()
    before, *empties = empty(folder, 1 + len(others))
    codes = {
        IDLC: (f"{idlc_package(work)}\nmessages.{first}", [f"messages.{name}" for name in others]),
        "empty module": (before, empties),
    }
    return warmed(folder, codes)


def plain_messages() -> list[str]:
    """Return the messages of std_msgs that stand alone and hold no arrays; String comes first."""
    own = [name for name in catalog.interfaces() if name.package == "std_msgs"]
    plain = [name.name for name in own if not set("[/") & set(catalog.source(name).text)]
    return sorted(plain, key=lambda name: name != "String")


def idlc_package(work: Work) -> str:
    path = f"import sys; sys.path.insert(0, {str(work.generated)!r})"
    return f"{path}\nimport {PREFIX}std_msgs.msg as messages"


def candidates(work: Work, purpose: str, wanted: list[str]):
    folder = work.folder / purpose
    folder.mkdir(exist_ok=True)
    touch = [f"messages.{name}" for name in wanted]
    codes = {
        IDLC: [idlc_package(work), *touch],
        "empty module": empty(folder, len(wanted)),
    }
    if installed("rclpy"):
        codes["rclpy"] = ["import std_msgs.msg as messages", *touch]
    if installed("rosbags"):
        codes["rosbags"] = [rosbags(folder, wanted)]
    if installed("cyclonedds"):
        codes["cyclonedds"] = [cyclonedds(folder, wanted)]
    return warmed(folder, {who: ("", lines) for who, lines in codes.items()}, len(wanted))


def warmed(folder: Path, codes: dict[str, tuple[str, list[str]]], count: int = 0):
    """Return the candidates of codes, each of which ran once, so that there is bytecode."""
    python = plain_python(folder / "python")
    found = {}
    for who, (before, lines) in codes.items():
        measured = "\n".join(lines)
        code = CODE.format(before=before, measured=measured, count=count or len(lines))
        found[who] = partial(imported, python, code)
        found[who]()
    return found


def imported(python: Path, code: str) -> float:
    return float(run([python, "-c", code], python.parents[2]))


def empty(folder: Path, count: int) -> list[str]:
    """Write empty modules in a package; return what imports each."""
    package = folder / "empty_modules"
    package.mkdir(exist_ok=True)
    modules = [f"empty_{index}" for index in range(count)]
    for name in ("__init__", *modules):
        (package / f"{name}.py").touch()
    return [f"import empty_modules.{name}" for name in modules]


def rosbags(folder: Path, wanted: list[str]) -> str:
    """Write the module that rosbags makes of the messages; return what imports it."""
    from rosbags.typesys import get_types_from_msg
    from rosbags.typesys.codegen import generate_python_code

    types = {}
    for name in structures(wanted):
        package, kind, type_ = name.split("/")
        text = run_idlc("show", name, "--format", "mcap").split("=" * 80)[0]
        types |= get_types_from_msg(text, f"{package}/{kind}/{type_}")
    (folder / "made_by_rosbags.py").write_text(generate_python_code(types), encoding="utf-8")
    return "import made_by_rosbags"


def cyclonedds(folder: Path, wanted: list[str]) -> str:
    text = cyclone.source(structures(wanted).values())
    (folder / "made_by_cyclonedds.py").write_text(text, encoding="utf-8")
    return "import made_by_cyclonedds"


def structures(wanted: list[str]) -> dict[str, dict]:
    """Return what the messages are made of, as `idlc show --format json` says it."""
    found = {}
    for name in wanted:
        facts = json.loads(run_idlc("show", f"std_msgs/msg/{name}", "--format", "json"))
        found |= {one["name"]: one for one in (*facts["structures"], *facts["uses"])}
    return found
