"""How long compiling takes: idlc, rosbags and the real rosidl on the same interface files.

Every measurement is a process of its own, in which the tool compiles one small package before the
clock starts: times are per file, after start-up, and of the whole after an edit. The clock counts
CPU time, user and system, because the wall's depends on what else uses the disk.
"""

import re
import shutil
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from benchmarks.measure import IDLC, Goal, Row
from benchmarks.peers import installed
from benchmarks.processes import ROOT, run
from benchmarks.work import Work
from idlc.model import catalog

KINDS = ("msg", "srv", "action")
#: What is compiled of a corpus when it shall be quick.
QUICK = {"builtin_interfaces", "service_msgs"}


def rows(work: Work) -> Iterator[Row]:
    corpora = {"catalogue": write_catalogue}
    if installed("rosidl"):
        corpora["wheels"] = copy_wheels
    row = partial(Row, "compile")
    for name, write in corpora.items():
        measured = partial(cold, work, name, write)
        yield row(f"messages of the {name}, a file", measured, Goal(times=1), rounds=7)
    write = partial(in_corpus, work, "catalogue", write_catalogue)
    ten = Goal(at_most=0.1, than="idlc cold")
    yield row("nothing changed, a file", lambda: unchanged(write()), ten, rounds=7)
    limit = Goal(at_most=0.05)
    yield row("after an edit, its package", lambda: edited(write(), "own"), limit, rounds=11)
    yield row("after an edit, everything", lambda: edited(write(), "all"), limit, rounds=11)
    if installed("rosidl"):
        slow = partial(against_rosidl, work)
        yield row("against rosidl, a file", slow, Goal(times=150), rounds=3)


def interface_files(root: Path) -> list[Path]:
    return sorted(path for kind in KINDS for path in root.glob(f"*/{kind}/*.{kind}"))


def write_catalogue(root: Path) -> None:
    """Write the built-in catalogue's interfaces as files, package by package."""
    for name in catalog.interfaces():
        path = root / name.package / name.kind / f"{name.name}.{name.kind}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(catalog.source(name).text, encoding="utf-8")


def copy_wheels(root: Path) -> None:
    """Copy the interface files that the wheels of ROS 2 installed."""
    share = Path(sysconfig.get_path("data")) / "share"
    for path in interface_files(share):
        target = root / path.relative_to(share)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)


def in_corpus(work: Work, name: str, write) -> Path:
    """Return the folder of a corpus, written on first use."""
    folder = work.folder / name
    if not folder.exists():
        write(folder)
        for path in folder.iterdir():
            if work.quick and path.name not in QUICK:
                shutil.rmtree(path)
    return folder


def messages_of(work: Work, name: str, write) -> Path:
    """Return the folder with what rosbags can read of a corpus: no services, actions, wstrings."""
    inputs = in_corpus(work, name, write)
    folder = work.folder / f"{name}_messages"
    for path in inputs.glob("*/msg/*.msg"):
        if not re.search("^wstring", path.read_text(encoding="utf-8"), re.MULTILINE):
            target = folder / path.relative_to(inputs)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, target)
    return folder


def compiled(task: str, inputs: Path, out: Path, *, fresh: bool) -> float:
    """Return the seconds of one run of `benchmarks.compilers`; a fresh one in a folder below."""
    out.mkdir(parents=True, exist_ok=True)
    if fresh:
        out = Path(tempfile.mkdtemp(dir=out))
    words = [sys.executable, "-m", "benchmarks.compilers", task, inputs, out]
    # not in the project: each package's run would read its pyproject.toml, which others do not
    return float(run(words, inputs, PYTHONPATH=str(ROOT)).split()[-1])


def cold(work: Work, name: str, write):
    inputs = messages_of(work, name, write)
    out = work.folder / f"{name}_out"
    tasks = {IDLC: "idlc"}
    if installed("rosbags"):
        tasks |= {"rosbags": "rosbags", "rosbags, codecs too": "rosbags_codecs"}
    return {
        who: partial(compiled, task, inputs, out / task, fresh=True) for who, task in tasks.items()
    }


def unchanged(inputs: Path):
    out = inputs.with_name("unchanged_out")
    compiled("idlc", inputs, out, fresh=False)
    return {
        IDLC: partial(compiled, "idlc", inputs, out, fresh=False),
        "idlc cold": partial(compiled, "idlc", inputs, out.with_name("cold_out"), fresh=True),
    }


def edited(inputs: Path, extent: str):
    out = inputs.with_name(f"edited_{extent}_out")
    compiled("idlc", inputs, out, fresh=False)
    return {IDLC: partial(compiled, f"edit_{extent}", inputs, out, fresh=False)}


def against_rosidl(work: Work):
    inputs = in_corpus(work, "wheels", copy_wheels)
    out = work.folder / "wheels_out"
    tasks = {IDLC: "idlc", "rosidl": "rosidl_quick" if work.quick else "rosidl"}
    return {
        who: partial(compiled, task, inputs, out / task, fresh=True) for who, task in tasks.items()
    }
