"""How long compiling takes: idlc, rosbags and the real rosidl on the same interface files.

Every measurement is a process of its own, in which the tool compiles one small package before the
clock starts: times are per file, after start-up, and start-up is measured apart. The clock counts
CPU time, user and system, because the wall's depends on what else uses the disk. Rounds are
interleaved, and the median counts.
"""

import importlib.util
import json
import os
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SHARE = Path(sys.prefix) / "share"
REPOSITORY = Path(__file__).resolve().parents[1]
ROUNDS = 7
ROSIDL_ROUNDS = 3
ROSIDL_FILES = 30
KINDS = ("msg", "srv", "action")


def interface_files(root: Path) -> list[Path]:
    return sorted(path for kind in KINDS for path in root.glob(f"*/{kind}/*.{kind}"))


def write_catalogue(root: Path) -> None:
    """Write the built-in catalogue's interfaces as files, package by package."""
    from idlc.model import catalog

    for name in catalog.interfaces():
        path = root / name.package / name.kind / f"{name.name}.{name.kind}"
        path.parent.mkdir(parents=True, exist_ok=True)
        source = catalog.source(name)
        assert source is not None
        path.write_text(source.text, encoding="utf-8")


# what runs in a process of its own; each returns the number of files


def run_idlc(inputs: Path, out: Path) -> int:
    from idlc.cli.main import main

    packages = sorted({path.parts[-3] for path in interface_files(inputs)})
    for package in packages:
        arguments = ["gen", str(inputs / package), "-o", str(out / package), "-I", str(inputs)]
        status = main([*arguments, "--package", package])
        assert status == 0, f"idlc gen failed on {package}"
    return len(interface_files(inputs))


def run_rosbags(inputs: Path, codecs: bool) -> int:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    from rosbags.typesys.codegen import generate_python_code

    store = get_typestore(Stores.EMPTY)
    types = {}
    for path in interface_files(inputs):
        text = path.read_text(encoding="utf-8")
        # rosbags knows neither services and actions nor wstring
        if path.suffix == ".msg" and not re.search("^wstring", text, re.MULTILINE):
            types.update(get_types_from_msg(text, f"{path.parts[-3]}/msg/{path.stem}"))
    generate_python_code(types)
    store.register(types)
    for name in types:
        store.hash_rihs01(name)
        if codecs:
            store.get_msgdef(name)
    return len(types)


def prepare_rosidl(inputs: Path, out: Path) -> list[Path]:
    """Choose files and lay out what rosidl expects of packages that are installed already."""
    files = interface_files(inputs)
    chosen = files[:: max(1, len(files) // ROSIDL_FILES)]
    for package in {path.parts[-3] for path in chosen}:
        for description in (SHARE / package).glob("*/*.json"):
            target = out / package / description.parent.name / description.name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(description, target)
    return chosen


def run_rosidl(chosen: list[Path], out: Path) -> int:
    from rosidl_adapter import convert_to_idl
    from rosidl_generator_py import generate_py
    from rosidl_generator_type_description import generate_type_hash

    packages: dict[str, list[Path]] = {}
    for path in chosen:
        packages.setdefault(path.parts[-3], []).append(path)
    include = [f"{path.parent.name}:{path.parent}" for path in SHARE.glob("*/msg")]
    for package, paths in packages.items():
        tuples = []
        for path in paths:
            relative = path.relative_to(path.parents[1])
            convert_to_idl(path.parents[1], package, relative, out / "idl" / package)
            tuples.append(f"{out / 'idl' / package}:{relative.with_suffix('.idl')}")
        arguments = out / "arguments.json"
        content = {
            "package_name": package,
            "output_dir": str(out / package),
            "idl_tuples": tuples,
            "include_paths": include,
            "template_dir": str(SHARE / "rosidl_generator_py" / "resource"),
            "target_dependencies": [__file__],
        }
        arguments.write_text(json.dumps(content), encoding="utf-8")
        generate_type_hash(str(arguments))
        generate_py(str(arguments), [])
    return len(chosen)


def worker(task: str, inputs: Path, out: Path) -> None:
    """Run one task and print its CPU seconds and number of files as the last line."""

    def run(inputs: Path, out: Path, chosen: list[Path]) -> int:
        match task:
            case "idlc cold" | "idlc unchanged":
                return run_idlc(inputs, out)
            case "rosidl":
                return run_rosidl(chosen, out)
            case _:
                return run_rosbags(inputs, codecs=task == "rosbags, codecs too")

    chosen = prepare_rosidl(inputs, out) if task == "rosidl" else []
    with tempfile.TemporaryDirectory() as folder:
        small = Path(folder, "in", "warm", "msg", "Warm.msg")
        small.parent.mkdir(parents=True)
        small.write_text("int8 warm  # [m]\nstring[] s\n")
        run(Path(folder, "in"), Path(folder, "out"), [small])
    started = time.process_time()
    count = run(inputs, out, chosen)
    print(json.dumps([time.process_time() - started, count]))


# the measurements


def measure(task: str, inputs: Path, out: Path) -> tuple[float, int]:
    """Return the seconds per file and the number of files of one run."""
    command = [sys.executable, str(Path(__file__).resolve()), task, str(inputs), str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=out.parent)
    assert done.returncode == 0, done.stderr[-3000:]
    seconds, count = json.loads(done.stdout.splitlines()[-1])
    return seconds / count, count


def measure_all(inputs: Path, work: Path, tasks: list[str]) -> dict[str, tuple[float, int]]:
    times: dict[str, list[float]] = {task: [] for task in tasks}
    counts = {}
    for round_ in range(ROUNDS):
        for task in tasks:
            if task == "rosidl" and round_ >= ROSIDL_ROUNDS:
                continue
            out = work / task.split()[0]
            if task != "idlc unchanged":
                shutil.rmtree(out, ignore_errors=True)
                out.mkdir(parents=True)
            seconds, counts[task] = measure(task, inputs, out)
            times[task].append(seconds)
    return {task: (statistics.median(times[task]), counts[task]) for task in tasks}


def print_table(title: str, found: dict[str, tuple[float, int]]) -> None:
    cold, _ = found["idlc cold"]
    print(f"\n{title}\n{'':24}{'files':>7}{'ms/file':>10}{'against idlc cold':>20}")
    for task, (seconds, count) in found.items():
        print(f"{task:24}{count:7}{seconds * 1e3:10.3f}{seconds / cold:19.2f}x")


def goal(what: str, reached: float, wanted: float, at_most: bool = False) -> None:
    good = reached <= wanted if at_most else reached >= wanted
    word = "at most" if at_most else "at least"
    print(f"{'ok  ' if good else 'MISS'} {what}: {reached:.2f} ({word} {wanted:g})")


def start_up() -> dict[str, float]:
    """Return the CPU seconds of small runs of idlc and of a bare interpreter, without ROS.

    The wheels of ROS make every interpreter start twice, so a second environment borrows only
    the packages of this one. What is checked is one file of a package, as a hook does.
    """
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "venv", "--without-pip", f"{folder}/venv"]
        subprocess.run(command, check=True)
        python = f"{folder}/venv/bin/python"
        (site,) = Path(folder).glob("venv/lib/python*/site-packages")
        borrow(site)
        package = Path(folder, "demo")
        (package / "msg").mkdir(parents=True)
        (package / "package.xml").write_text(
            "<package><name>demo</name><depend>std_msgs</depend></package>"
        )
        (package / "msg/Drive.msg").write_text("std_msgs/Header header\nfloat64 speed  # [m/s]\n")
        commands = {
            "bare": [python, "-c", ""],
            "idlc --version": [python, "-m", "idlc", "--version"],
            "idlc check FILE": [python, "-m", "idlc", "check", str(package / "msg/Drive.msg")],
        }
        times: dict[str, list[float]] = {name: [] for name in commands}
        for _ in range(25):
            for name, words in commands.items():
                times[name].append(cpu_seconds(words, folder))
    return {name: statistics.median(seconds) for name, seconds in times.items()}


def borrow(site: Path) -> None:
    """Give an environment idlc and what it needs, compiled, and nothing else."""
    (site / "idlc").symlink_to(REPOSITORY / "idlc")
    for package in ("click", "jinja2", "lark", "libcst", "markupsafe", "msgspec", "rich"):
        found = importlib.util.find_spec(package)
        assert found is not None
        assert found.origin is not None
        (site / package).symlink_to(Path(found.origin).parent)


def cpu_seconds(words: list[str], folder: str) -> float:
    # as installed packages are: compiled
    environment = {
        **os.environ,
        "PYTHONDONTWRITEBYTECODE": "",
        "PYTHONPATH": "",
        "PYTHONPYCACHEPREFIX": f"{folder}/compiled",
    }
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(words, check=True, cwd=folder, env=environment, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        catalogue, installed = Path(folder, "catalogue"), Path(folder, "installed")
        write_catalogue(catalogue)
        for path in interface_files(SHARE):
            target = installed / path.relative_to(SHARE)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, target)
        tasks = ["idlc cold", "idlc unchanged", "rosbags", "rosbags, codecs too"]
        print(f"Compiling, median of {ROUNDS} rounds, Python {sys.version.split()[0]}")
        built_in = measure_all(catalogue, Path(folder, "work"), tasks)
        print_table("the built-in catalogue", built_in)
        wheels = measure_all(installed, Path(folder, "work"), [*tasks, "rosidl"])
        print_table("the interface files of the installed wheels", wheels)
    started = start_up()
    bare = started["bare"]
    listed = ", ".join(f"{name} {seconds * 1e3:.1f} ms" for name, seconds in started.items())
    print(f"\nstarting up: {listed}\n")
    for where, found in (("catalogue", built_in), ("wheels", wheels)):
        cold = found["idlc cold"][0]
        goal(f"{where}: rosbags' time per idlc's, cold", found["rosbags"][0] / cold, 1)
        goal(f"{where}: cold time per unchanged", cold / found["idlc unchanged"][0], 10)
    goal(
        "wheels: rosidl's time per idlc's, cold", wheels["rosidl"][0] / wheels["idlc cold"][0], 150
    )
    for name, most in (("idlc --version", 3), ("idlc check FILE", 5)):
        goal(f"{name} per bare interpreter start", started[name] / bare, most, at_most=True)


if __name__ == "__main__":
    if len(sys.argv) == 4:
        os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        worker(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
    else:
        main()
