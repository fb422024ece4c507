"""`runtime = "installed"`: packages import idlc-runtime, and mix with those that carry a copy."""

import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from setuptools import Distribution

from idlc.build import compile_at_build
from idlc.cli.main import main
from idlc.runtime import PROTOCOL
from idlc.version import RUNTIME, __version__
from tests.support import generated
from tests.support.paths import ROOT
from tests.support.programs import clean_environment, ended, run

#: The packages that actions need.
IMPLIED = ("action_msgs", "builtin_interfaces", "service_msgs", "unique_identifier_msgs")
ONE_FIELD = {"msg/Drive.msg": "float64 speed 0.5  # forward [m/s]\n"}
PARTS = {
    "msg/Plain.msg": "float64 x\nint32[] numbers\nstring<=3[] names\nInner inner\n",
    "msg/Inner.msg": "bool[3] flags\nwstring wide\n",
    "msg/Fixed.msg": "float64[3] values\n",
    "srv/Ask.srv": "string what\n---\nint32[] answers\n",
    "action/Move.action": "float32 to\n---\nbool ok\n---\nfloat32 at\n",
}
USES = {"msg/Path.msg": "parts_msgs/Inner[] points\nparts_msgs/Fixed[<=2] fixed\nfloat32 x\n"}


def write(folder, files):
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    return folder


def choose(mode):
    """Set the runtime mode of packages that are generated in the working folder."""
    Path("pyproject.toml").write_text(f'[tool.idlc]\nruntime = "{mode}"\n', encoding="utf-8")


def compile_packages(folder, packages, *, installed=None):
    """Generate packages into a folder; those `installed`, by default all, import the runtime."""
    for name, files in packages.items():
        write(folder / "in" / name, files)
    for name in packages:
        mode = "installed" if installed is None or name in installed else "carried"
        words = ("--package", name, "-I", folder / "in")
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(folder)
            choose(mode)
            status = main([*map(str, ("gen", folder / "in" / name, "-o", folder / name, *words))])
        assert status == 0, name


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder with what the wheel of idlc-runtime installs."""
    folder = tmp_path_factory.mktemp("site")
    shutil.copytree(
        ROOT / "maintenance/runtime/idlc_runtime",
        folder / "idlc_runtime",
        ignore=shutil.ignore_patterns("__pycache__", ".*", "ruff.toml"),
    )
    return folder


def execute(*folders, code, options=("-I", "-S")):
    """Run code in an interpreter that has the standard library and some folders."""
    paths = [str(folder) for folder in folders]
    command = [sys.executable, *options, "-c", f"import sys; sys.path[:0] = {paths!r}\n{code}"]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_one_field_is_little(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(write(tmp_path / "demo", ONE_FIELD).parent)
    choose("installed")
    assert main(["gen", "demo", "-o", "out/demo"]) == 0
    line = "wrote out/demo: 7 files from 1 interface; imports idlc_runtime\n"
    assert capsys.readouterr().out == line
    files = [path for path in Path("out").rglob("*") if path.is_file()]
    texts = {path.name: path.read_text(encoding="utf-8") for path in files}
    assert len(files) <= 8
    assert sum(len(text.splitlines()) for text in texts.values()) <= 150
    assert len(texts["_idlc.py"].splitlines()) <= 25


USE = """
from parts_msgs.msg import Plain, Inner
from parts_msgs.srv import Ask
from parts_msgs.action import Move
from parts_msgs import _idlc
import copy, dataclasses, inspect, json, pickle, typing
import idlc_runtime
message = Plain(1.5, [1, 2], ["a"], Inner([True, False, True], "w"))
for order in ("little", "big"):
    assert Plain.deserialize(message.serialize(byteorder=order)) == message
assert Plain.from_dict(json.loads(json.dumps(message.to_dict()))) == message
message.validate()
assert pickle.loads(pickle.dumps(message)) == copy.deepcopy(message) == message
checked = Plain(check_fields=True)
assert pickle.loads(pickle.dumps(checked)) == checked
assert Move.Goal.deserialize(Move.Goal(0.5).serialize()).to == 0.5
assert Move.Impl.FeedbackMessage is not None
assert isinstance(message, _idlc.Message) and isinstance(message, idlc_runtime.Message)
assert typing.get_type_hints(Plain.__init__)["x"] is float
assert inspect.getdoc(_idlc).startswith("The runtime of parts_msgs")
for error, wrong in (
    (_idlc.DecodeError, lambda: Plain.deserialize(b"")),
    (_idlc.ValidationError, lambda: Plain(names=["long"]).validate()),
):
    try:
        wrong()
    except error as caught:
        print(type(caught).__module__, caught)
print(*sorted(set(sys.modules) & {"numpy", "idlc", "lark", "jinja2", "msgspec", "rclpy"}))
"""


def test_it_works_with_the_runtime_and_nothing_else(site, tmp_path):
    standard = generated.catalog_files()
    compile_packages(tmp_path, {"parts_msgs": PARTS})
    compile_packages(tmp_path, {name: standard[name] for name in IMPLIED}, installed={IMPLIED[0]})
    result = execute(site, tmp_path, code=USE, options=("-I",))
    assert result.stderr == ""
    assert result.stdout.splitlines() == [
        "idlc_runtime.names the encapsulation header needs 4 bytes, there are 0 at byte 0",
        "idlc_runtime.names names[0]: has 4 characters, at most 3 are allowed",
        "",
    ]


def test_importing_imports_no_more_than_of_a_copy(site, tmp_path):
    code = (
        "before = set(sys.modules)\nfrom parts_msgs.msg import Inner\nInner().serialize()\n"
        "print(*sorted(name.split('.')[-1] for name in set(sys.modules) - before))"
    )
    modules = {}
    for installed in (False, True):
        folder = tmp_path / str(installed)
        compile_packages(
            folder, {"parts_msgs": PARTS}, installed={"parts_msgs"} if installed else ()
        )
        result = execute(site, folder, code=code)
        assert result.stderr == ""
        modules[installed] = set(result.stdout.split())
    assert modules[True] - {"idlc_runtime"} == modules[False]


IMPORT = """
try:
    import parts_msgs.msg
except ImportError as error:
    print(type(error).__name__, error.name, error)
"""


def test_without_the_runtime_a_sentence_says_what_to_install(tmp_path):
    compile_packages(tmp_path, {"parts_msgs": PARTS})
    result = execute(tmp_path, code=IMPORT)
    assert result.stdout == (
        "ModuleNotFoundError idlc_runtime "
        f"parts_msgs needs idlc-runtime: pip install 'idlc-runtime>={__version__}'\n"
    )


def test_the_sentence_reaches_who_uses_it_as_a_dependency(tmp_path):
    packages = {"parts_msgs": PARTS, "uses_msgs": USES}
    compile_packages(tmp_path, packages, installed={"parts_msgs"})
    code = IMPORT.replace("parts_msgs.msg", "uses_msgs.msg; uses_msgs.msg.Path()")
    said = execute(tmp_path, code=code).stdout
    assert said.endswith(f"parts_msgs needs idlc-runtime: pip install '{RUNTIME}'\n"), said
    assert "ros-jazzy" not in said


def test_what_is_wrong_within_the_runtime_is_not_hidden(tmp_path):
    compile_packages(tmp_path, {"parts_msgs": PARTS})
    write(tmp_path, {"idlc_runtime/__init__.py": "import lost_and_gone\n"})
    result = execute(tmp_path, code=IMPORT)
    assert result.stdout == "ModuleNotFoundError lost_and_gone No module named 'lost_and_gone'\n"


@pytest.mark.parametrize("other", [PROTOCOL - 1, PROTOCOL + 1])
def test_a_runtime_of_another_protocol_is_refused(other, site, tmp_path):
    compile_packages(tmp_path, {"parts_msgs": PARTS})
    shutil.copytree(site / "idlc_runtime", tmp_path / "idlc_runtime")
    place = tmp_path / "idlc_runtime/__init__.py"
    text = place.read_text(encoding="utf-8")
    changed = text.replace(f"\nPROTOCOL = {PROTOCOL}\n", f"\nPROTOCOL = {other}\n")
    assert changed != text
    place.write_text(changed, encoding="utf-8")
    result = execute(tmp_path, code=IMPORT)
    assert result.stdout == (
        f"ImportError idlc_runtime parts_msgs needs protocol {PROTOCOL} of idlc-runtime, not "
        f"{other}: pip install 'idlc-runtime~={__version__}', or run `idlc gen` again\n"
    )


MIX = """
from parts_msgs.msg import Fixed, Inner
from uses_msgs.msg import Path
import pickle
path = Path([Inner([True] * 3, "w")], [Fixed([1.0, 2.0, 3.0])], 1.5)
again = Path.deserialize(path.serialize())
assert again == path and path == again
assert type(again.points[0]) is Inner and type(again.fixed[0]) is Fixed
assert Path.deserialize(path.serialize(byteorder="big")) == path
path.validate()
assert Path.from_dict(path.to_dict()) == path
assert pickle.loads(pickle.dumps(path)) == path
checked = Path(check_fields=True)
checked.points = [Inner([False] * 3)]
assert type(checked.points[0]) is Inner
path.points[0].wide = 3
for refused in (path.validate, path.serialize):
    try:
        refused()
    except ValueError as error:
        print(error)
for cut in range(4, len(again.serialize())):
    try:
        Path.deserialize(again.serialize()[:cut])
    except ValueError as error:
        assert "at byte" in str(error)
    else:
        raise AssertionError(cut)
"""


@pytest.mark.parametrize("installed", [{"parts_msgs"}, {"uses_msgs"}, {"parts_msgs", "uses_msgs"}])
def test_packages_of_both_modes_use_each_other(installed, site, tmp_path):
    compile_packages(tmp_path, {"parts_msgs": PARTS, "uses_msgs": USES}, installed=installed)
    result = execute(site, tmp_path, code=MIX, options=("-I",))
    assert result.stderr == ""
    assert result.stdout == "points[0].wide: must be a str, not 3\n" * 2


def test_switching_removes_or_writes_the_copy(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(write(tmp_path / "demo", ONE_FIELD).parent)

    def gen(*options):
        status = main(["gen", "demo", "-o", "out/demo", *options])
        return status, capsys.readouterr().out.partition(" interface")[2].strip()

    def mode():
        record = json.loads(Path("out/demo/idlc.lock").read_text(encoding="utf-8"))
        assert Path("out/demo/_idlc.py").is_file() == (record.get("runtime") == "installed")
        assert Path("out/demo/_idlc").is_dir() != Path("out/demo/_idlc.py").is_file()
        return record.get("runtime", "carried")

    copies = len(list((ROOT / "idlc/runtime").rglob("*.py")))
    assert gen()[0] == 0
    assert mode() == "carried"
    choose("installed")
    assert gen("--check")[0] == 1
    assert mode() == "carried"
    said = f"(1 written, {copies} removed); imports idlc_runtime"
    assert gen() == (0, said)
    assert mode() == "installed"
    Path("pyproject.toml").unlink()
    assert gen() == (0, "(unchanged); imports idlc_runtime")
    assert gen("--check") == (0, "(up to date)")
    Path("demo/msg/More.msg").write_text("int8 x\n", encoding="utf-8")
    assert gen()[0] == 0
    assert mode() == "installed"
    choose("carried")
    assert gen("--check")[0] == 1
    assert gen() == (0, f"s ({copies} written, 1 removed)")
    assert mode() == "carried"


def test_an_edited_copy_is_not_removed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(write(tmp_path / "demo", ONE_FIELD).parent)
    assert main(["gen", "demo", "-o", "out/demo"]) == 0
    edited = Path("out/demo/_idlc/names.py")
    edited.write_text(edited.read_text(encoding="utf-8") + "#\n", encoding="utf-8")
    choose("installed")
    assert main(["gen", "demo", "-o", "out/demo"]) == 1
    assert "IDL613" in capsys.readouterr().err
    assert edited.is_file()
    assert not Path("out/demo/_idlc.py").exists()


def test_a_setting_that_is_neither_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(write(tmp_path / "demo", ONE_FIELD).parent)
    Path("pyproject.toml").write_text('[tool.idlc]\nruntime = "shared"\n', encoding="utf-8")
    assert main(["gen", "demo", "-o", "out/demo"]) == 2
    assert '`runtime` in [tool.idlc] must be "carried" or' in capsys.readouterr().err


@pytest.mark.parametrize("place", ["settings", "lock"])
def test_setup_py_compiles_in_the_mode_of_the_package(place, tmp_path, monkeypatch):
    folder = write(tmp_path / "demo", {**ONE_FIELD, "setup.py": "", "package.xml": MANIFEST})
    monkeypatch.chdir(folder)
    choose("installed")
    if place == "lock":
        assert main(["gen"]) == 0
        Path("pyproject.toml").unlink()
    monkeypatch.setattr(sys, "argv", ["setup.py", "--version"])
    distribution = Distribution({"name": "demo", "packages": ["demo"]})
    distribution.commands = []
    compile_at_build(distribution, "idlc_interfaces", True)
    distribution.run_commands()
    assert (folder / "demo/_idlc.py").is_file()
    assert not (folder / "demo/_idlc").exists()


MANIFEST = """\
<package format="3">
  <name>demo</name>
  <version>1.0.0</version>
  <export><build_type>ament_python</build_type></export>
</package>
"""
SETUP = """\
from glob import glob
from setuptools import find_packages, setup

setup(
    idlc_interfaces=True,
    name='demo',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/demo']),
        ('share/demo', ['package.xml']),
        ('share/demo/msg', glob('msg/*.msg')),
        ('share/ament_index/resource_index/rosidl_interfaces', glob('resource/*/*')),
    ],
)
"""


def test_a_package_that_does_not_require_it_is_reported(tmp_path, monkeypatch, capsys):
    files = {**ONE_FIELD, "setup.py": SETUP, "package.xml": MANIFEST, "resource/demo": ""}
    monkeypatch.chdir(write(tmp_path / "demo", files))
    choose("installed")
    assert main(["gen"]) == 0
    capsys.readouterr()
    assert main(["check"]) == 0
    said = capsys.readouterr().out
    assert "IDL459" in said
    assert f"add `{RUNTIME}` to `install_requires`" in said
    assert "IDL462" not in said, "no package _idlc is missing"
    named = SETUP.replace(
        "    name=", f"    install_requires=['setuptools', '{RUNTIME}'],\n    name="
    )
    write(Path(), {"setup.py": named})
    assert main(["check"]) == 0
    assert "IDL459" not in capsys.readouterr().out
    write(Path(), {"setup.py": SETUP})
    choose("carried")
    assert main(["gen"]) == 0
    capsys.readouterr()
    assert main(["check"]) == 0
    assert "IDL459" not in capsys.readouterr().out


CLIENT = """
import parts_msgs._idlc as idlc
from parts_msgs.action import Move
from parts_msgs.msg import Fixed, Plain
from parts_msgs._idlc import DecodeError, ValidationError

plain = Plain(1.0, [1], names=["a"])
text: str = plain.names[0]
raw: bytes = plain.serialize()
try:
    plain = Plain.deserialize(raw)
except (DecodeError, ValidationError, idlc.DecodeError):
    pass
goal = Move.Goal(1.0)
level: float = goal.to
total: float = float(Fixed([1.0, 2.0, 3.0]).values.sum())
wrong: int = plain.names
"""


@pytest.mark.long
def test_type_checkers_see_through_it(wheel, tmp_path):
    """With the wheel in an environment that has numpy, as type checkers find libraries there."""
    compile_packages(tmp_path, {"parts_msgs": PARTS})
    (tmp_path / "client.py").write_text(CLIENT, encoding="utf-8")
    python = environment(tmp_path, wheel, "numpy")
    flags = ("--strict", "--python-executable", python, "--cache-dir", tmp_path / "cache")
    status, said = ended(
        sys.executable, "-m", "mypy", *flags, "client.py", "parts_msgs", cwd=tmp_path
    )
    assert status == 1
    lines = [line for line in said.splitlines() if "error:" in line]
    assert len(lines) == 1, said
    assert "client.py:17:" in lines[0]
    write(tmp_path, {"pyrightconfig.json": '{"typeCheckingMode": "strict"}'})
    words = ("--pythonpath", python, "client.py", "parts_msgs/_idlc.py")
    _, said = ended(sys.executable, "-m", "basedpyright", *words, cwd=tmp_path)
    assert [line.split("client.py:")[1][:3] for line in said.splitlines() if " error:" in line] == [
        "17:"
    ], said


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    """The wheel of idlc-runtime, built from its source distribution."""
    out = tmp_path_factory.mktemp("dist")
    tree = out / "tree"
    shutil.copytree(ROOT / "maintenance/runtime", tree)
    command = (sys.executable, "-m", "build", "--outdir", out, tree)
    run(*command, cwd=out, environment=clean_environment())
    (path,) = out.glob("*.whl")
    return path


def environment(folder, *requirements):
    """Return the interpreter of a new environment with some packages."""
    run(sys.executable, "-m", "venv", folder / "env", cwd=folder, environment=clean_environment())
    python = folder / "env/bin/python"
    words = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check", *requirements)
    run(python, *words, cwd=folder, environment=clean_environment())
    return python


@pytest.mark.long
def test_a_fresh_environment_needs_only_the_wheel(wheel, tmp_path):
    compile_packages(tmp_path / "code", {"parts_msgs": PARTS})
    python = environment(tmp_path, wheel)
    listed = run(python, "-m", "pip", "list", "--format", "json", cwd=tmp_path)
    assert {each["name"] for each in json.loads(listed)} <= {"idlc-runtime", "pip", "setuptools"}
    code = f"import sys; sys.path.insert(0, 'code')\n{USE.replace('assert Move.Impl', '# ')}"
    run(python, "-I", "-c", code, cwd=tmp_path)


@pytest.mark.long
def test_the_wheel_is_the_folder_that_packages_carry(wheel):
    runtime = ROOT / "idlc/runtime"
    sources = {path.relative_to(runtime).as_posix(): path for path in runtime.rglob("*.py")}
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist() if ".dist-info/" not in name}
        assert inside == {"idlc_runtime/py.typed", *(f"idlc_runtime/{path}" for path in sources)}
        for path, source in sources.items():
            assert archive.read(f"idlc_runtime/{path}") == source.read_bytes(), path
        (name,) = (name for name in archive.namelist() if name.endswith("/METADATA"))
        metadata = archive.read(name).decode("utf-8")
    assert f"\nVersion: {__version__}\n" in metadata
    assert "Requires-Dist" not in metadata
