"""`python -m maintenance.ecosystem FOLDER...`: run idlc on the clones in folders, and sum up.

Each line is a repository with the results of its commands. `--json FILE` writes them, so that the
files of two versions of idlc can be compared. The clones are not changed. Before `idlc init`, the
copy of each Python package gets a message. `idlc init` runs the builds of the packages: use it in
a container if you do not trust them.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from zipfile import ZipFile

#: Seconds for one command.
PATIENCE = 600
#: Exit statuses of idlc that are answers.
ANSWERS = (0, 1, 2)
PIP = ("-m", "pip", "wheel", "--quiet", "--no-deps", "--no-index", "--no-build-isolation")
#: A message that packages get, and the module of its class.
ADDED, MODULE = "EcosystemExample", "ecosystem_example"
#: Imports all modules of generated packages.
IMPORT = """
import importlib, pkgutil, sys
sys.path.insert(0, sys.argv[1])
for package in pkgutil.iter_modules([sys.argv[1]]):
    for module in ("msg", "srv", "action"):
        try:
            namespace = importlib.import_module(f"{package.name}.{module}")
        except ModuleNotFoundError as error:
            if error.name != f"{package.name}.{module}":
                raise
            continue
        for name in namespace.__all__:
            getattr(namespace, name)
"""


def run(folder: Path, *words: object) -> tuple[int, str]:
    """Run Python in a folder; return the exit status and the output."""
    command = [sys.executable, *map(str, words)]
    try:
        done = subprocess.run(  # noqa: S603 - the programs of the clones are meant to run
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return -1, "timeout"
    return done.returncode, done.stdout.decode("utf-8", "replace")


def idlc(folder: Path, *words: object) -> str:
    """Return the result of a command of idlc: its status, or `CRASH`."""
    status, text = run(folder, "-P", "-m", "idlc", *words)
    is_answer = status in ANSWERS and "Traceback" not in text and "IDL901" not in text
    return str(status) if is_answer else "CRASH"


def python_packages(folder: Path) -> Iterator[Path]:
    """Yield the folders of packages that setuptools builds, outermost first."""
    for place, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if "setup.py" in files and "package.xml" in files:
            folders.clear()
            yield Path(place)


def with_messages(clone: Path) -> None:
    """Give each Python package that has no folder for messages a message."""
    for package in python_packages(clone):
        if not (package / "msg").exists():
            (package / "msg").mkdir()
            (package / "msg" / f"{ADDED}.msg").write_text("int32 number\n", "utf-8")


def wheel_files(package: Path, scratch: Path) -> set[str] | None:
    """Return the names of the files in a package's wheel, `None` if it cannot be built."""
    with tempfile.TemporaryDirectory(dir=scratch) as place:
        copy = shutil.copytree(package, Path(place, package.name), symlinks=True)
        if run(Path(place), *PIP, "--wheel-dir", place, copy)[0]:
            return None
        wheel = next(Path(place).glob("*.whl"))
        with ZipFile(wheel) as archive:
            return {name for name in archive.namelist() if ".dist-info/" not in name}


def lost_files(clone: Path, changed: Path, scratch: Path) -> tuple[str, list[str]]:
    """Return how many wheels have all their files after a change, and the lost files.

    Classes of a message that was added are lost, too, if `idlc init` compiled them.
    """
    counts: Counter[str] = Counter()
    lost: list[str] = []
    for package in python_packages(clone):
        inside = package.relative_to(clone)
        before = wheel_files(package, scratch)
        after = None if before is None else wheel_files(changed / inside, scratch)
        if before is not None and after is None:
            lost.append(f"{inside}: cannot be built any more")
        elif before is not None and after is not None:
            counts["whole"] += not before - after
            lost += sorted(f"{inside}: {name}" for name in before - after)
            classes = (changed / inside).glob(f"**/msg/_{MODULE}.py")
            # `idlc init` lets CMake build packages, and compiles them into `build`
            is_compiled = any((changed / inside / "build") not in path.parents for path in classes)
            if is_compiled and not any(name.endswith(f"/msg/_{MODULE}.py") for name in after):
                lost.append(f"{inside}: the classes are not installed")
        counts["built" if before is not None else "cannot be built"] += 1
    others = f" ({counts['cannot be built']} not built)" if counts["cannot be built"] else ""
    return f"{counts['whole']}/{counts['built']}{others}", lost


def last_tags(clone: Path) -> list[str]:
    """Return the last two tags, the newest first."""
    words = ["git", "tag", "--sort=-creatordate"]
    done = subprocess.run(words, cwd=clone, capture_output=True, text=True, check=False)  # noqa: S603
    return done.stdout.split()[:2]


def examine(clone: Path) -> dict[str, object]:
    """Return the results for one repository."""
    facts: dict[str, object] = {"repository": clone.name}
    with tempfile.TemporaryDirectory(prefix="ecosystem-") as place:
        scratch = Path(place)
        for name, words in (("fix", ("check", "--fix", ".")), ("init", ("init", ".", "--yes"))):
            copy = shutil.copytree(clone, scratch / name / clone.name, symlinks=True)
            if name == "fix":
                facts["check"] = idlc(copy, "check", ".")
            else:
                with_messages(copy)
            facts[name] = idlc(copy, *words)
            facts[f"wheels after {name}"], lost = lost_files(clone, copy, scratch)
            facts[f"lost by {name}"] = lost
        facts["gen"] = idlc(clone, "gen", ".", "-o", scratch / "gen")
        if facts["gen"] == "0":
            is_package = (scratch / "gen/idlc.lock").exists()
            packages = scratch if is_package else scratch / "gen"
            facts["import"] = str(run(scratch, "-I", "-c", IMPORT, packages)[0])
        if len(tags := last_tags(clone)) == 2:
            copy = scratch / "tags"
            words = ["git", "clone", "-q", "--branch", tags[0], str(clone), str(copy)]
            subprocess.run(words, capture_output=True, check=False)  # noqa: S603
            facts["breaking"] = idlc(copy, "breaking", ".", "--against", f"git:{tags[1]}")
    return facts


def line_of(facts: dict[str, object]) -> str:
    """Return the results for one repository on one line."""
    name, *rest = facts.items()
    return f"{name[1]}: " + ", ".join(f"{key} {value}" for key, value in rest if value != [])


def main() -> int:
    """Examine all repositories in folders; return 1 if a command crashed or a file was lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="repositories at a time")
    options = parser.parse_args()
    clones = [
        clone.resolve()
        for folder in options.folders
        for clone in sorted(folder.iterdir())
        if (clone / ".git").exists()
    ]
    results = []
    with ThreadPoolExecutor(options.jobs) as pool:
        for facts in pool.map(examine, clones):
            print(line_of(facts), flush=True)
            results.append(facts)
    bad = [
        facts["repository"]
        for facts in results
        if "CRASH" in facts.values() or facts["lost by fix"] or facts["lost by init"]
    ]
    print(
        f"{len(results)} repositories, {len(bad)} with faults of idlc: {', '.join(map(str, bad))}"
    )
    if options.json:
        options.json.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n", "utf-8")
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
