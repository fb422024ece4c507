"""One run of a compiler on a folder of packages: compilers.py TASK INPUTS OUT.

Compiles something small before the clock starts, and prints seconds as the last line: CPU time per
file, and of the whole after an edit.
"""

import json
import shutil
import sys
import sysconfig
import tempfile
import time
from functools import partial
from pathlib import Path

from benchmarks.compiling import interface_files

SHARE = Path(sysconfig.get_path("data")) / "share"
ROSIDL_FILES = 30


def gen(package: Path, out: Path) -> None:
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
    from idlc.project.settings import Scope
    from idlc.tasks.gen import GenOptions
    from idlc.tasks.gen import gen as gen_gen

    paths, include = (str(package),), (str(package.parent),)
    options = GenOptions(paths, Scope(Root.here(), package.name, include), str(out / package.name))
    assert gen_gen(options, Report()), f"idlc gen failed on {package}"


def idlc(files: list[Path], out: Path) -> int:
    for package in sorted({path.parents[1] for path in files}):
        gen(package, out)
    return len(files)


def rosbags(files: list[Path], out: Path, *, codecs: bool) -> int:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    from rosbags.typesys.codegen import generate_python_code

    store = get_typestore(Stores.EMPTY)
    types = {}
    for path in files:
        text = path.read_text(encoding="utf-8")
        types.update(get_types_from_msg(text, f"{path.parts[-3]}/msg/{path.stem}"))
    (out / "types.py").write_text(generate_python_code(types), encoding="utf-8")
    store.register(types)
    for name in types:
        store.hash_rihs01(name)
        if codecs:
            store.get_msgdef(name)
    return len(types)


def rosidl(files: list[Path], out: Path, *, most: int) -> int:
    from rosidl_adapter import convert_to_idl
    from rosidl_generator_py import generate_py
    from rosidl_generator_type_description import generate_type_hash

    chosen = files[:: max(1, len(files) // most)]
    packages: dict[str, list[Path]] = {}
    for path in chosen:
        packages.setdefault(path.parts[-3], []).append(path)
    include = [f"{path.parent.name}:{path.parent}" for path in SHARE.glob("*/msg")]
    for package, paths in packages.items():
        # what rosidl expects of packages that are installed already
        for description in (SHARE / package).glob("*/*.json"):
            target = out / package / description.parent.name / description.name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(description, target)
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


TASKS = {
    "idlc": idlc,
    "rosbags": partial(rosbags, codecs=False),
    "rosbags_codecs": partial(rosbags, codecs=True),
    "rosidl": partial(rosidl, most=ROSIDL_FILES),
    "rosidl_quick": partial(rosidl, most=1),
}


def rebuild(inputs: Path, out: Path, *, everything: bool) -> float:
    """Edit a message of the largest package; return how long that, or everything, takes then."""
    package = max(inputs.iterdir(), key=lambda package: len(list(package.glob("msg/*.msg"))))
    path = min(package.glob("msg/*.msg"))
    path.write_text(f"{path.read_text(encoding='utf-8')}# {time.time()}\n", encoding="utf-8")
    begin = time.process_time()
    if everything:
        idlc(interface_files(inputs), out)
    else:
        gen(package, out)
    return time.process_time() - begin


def main(task: str, inputs: Path, out: Path) -> float:
    run = TASKS.get(task, idlc)
    folder = tempfile.mkdtemp(dir=out.parent)  # it goes with what OUT is in
    small = Path(folder, "in", "warm", "msg", "Warm.msg")
    small.parent.mkdir(parents=True)
    small.write_text("int8 warm  # [m]\nstring[] s\n", encoding="utf-8")
    Path(folder, "out").mkdir()
    run([small], Path(folder, "out"))
    if task not in TASKS:
        return rebuild(inputs, out, everything=task == "edit_all")
    files = interface_files(inputs)
    begin = time.process_time()
    count = run(files, out)
    return (time.process_time() - begin) / count


if __name__ == "__main__":
    print(main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])))
