"""A library that comes with the types that it uses: on its own, and beside other packages."""

import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support import generated, programs
from tests.support.paths import ROOT

INTERFACES = {
    "msg/Track.msg": "std_msgs/Header header\ngeometry_msgs/Point[] points\nPart part\n",
    "msg/Part.msg": "builtin_interfaces/Time[<=2] times\n",
    "srv/Ask.srv": "std_msgs/Header header\n---\nbool ok\n",
    "action/Go.action": "int32 up_to\n---\ngeometry_msgs/Point end\n---\nfloat64 far\n",
}
HEADER = {"msg/Header.msg": "builtin_interfaces/Time stamp\nstring frame_id\n"}
TIME = {"msg/Time.msg": "int32 sec\nuint32 nanosec\n"}


def write(folder, files):
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")


def gen(folder, out, *options, package="track_msgs"):
    assert main(["gen", str(folder), "-o", str(out), "--package", package, *options]) == 0


@pytest.fixture(scope="module")
def interfaces(tmp_path_factory):
    folder = tmp_path_factory.mktemp("interfaces")
    write(folder, INTERFACES)
    return folder


@pytest.fixture(scope="module")
def library(interfaces, tmp_path_factory):
    """A folder with a library, deep in which there are messages."""
    folder = tmp_path_factory.mktemp("library")
    gen(interfaces, folder / "lib/ros", "--vendor-deps")
    return folder


@pytest.fixture(scope="module")
def only_numpy(tmp_path_factory):
    """A folder with nothing but numpy."""
    folder = tmp_path_factory.mktemp("numpy")
    installed = Path(importlib.util.find_spec("numpy").origin).parent
    for path in (installed, installed.with_name("numpy.libs")):
        if path.exists():
            (folder / path.name).symlink_to(path)
    return folder


def packages(folder, **files):
    """Write packages of idlc's, as if somebody had installed them; return the folder."""
    for package, texts in files.items():
        generated.write_package(folder, package, texts)
    return folder


def run(code, *folders):
    """Run code in an interpreter that has the standard library and folders, and no ROS 2."""
    begin = f"import sys; sys.path[:0] = {[str(folder) for folder in folders]!r}\n"
    return subprocess.run(
        [sys.executable, "-I", "-S", "-c", begin + code],
        capture_output=True,
        text=True,
        check=False,
    )


def prints(code, *folders):
    done = run(code, *folders)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def fails(code, *folders):
    """Return the last line of the traceback of code."""
    done = run(code, *folders)
    assert done.returncode == 1, done.stdout
    return done.stderr.splitlines()[-1]


def test_it_has_what_it_uses_and_one_runtime(library):
    vendored = library / "lib/ros/_vendor"
    assert sorted(path.name for path in vendored.iterdir() if path.is_dir()) == [
        "action_msgs",
        "builtin_interfaces",
        "geometry_msgs",
        "service_msgs",
        "std_msgs",
        "unique_identifier_msgs",
    ]
    messages = vendored / "geometry_msgs/msg"
    assert sorted(path.name for path in messages.glob("_[a-z]*.py")) == [
        "_point.py",
        "_point__codec.py",
    ]
    assert [path.parent.name for path in library.rglob("_idlc")] == ["ros"]
    assert not [path for path in library.iterdir() if path.name != "lib"]


def test_a_package_without_dependencies_has_no_copies(tmp_path):
    write(tmp_path, {"msg/Plain.msg": "int8 x\n"})
    gen(tmp_path, tmp_path / "out", "--vendor-deps", package="plain_msgs")
    assert not (tmp_path / "out/vendor").exists()
    gen(tmp_path, tmp_path / "out", "--vendor-deps=beside", "--check", package="plain_msgs")


USE = """
import lib.ros.vendor.std_msgs.msg
from lib.ros import vendor
from lib.ros.msg import Part, Track
from lib.ros.vendor.builtin_interfaces.msg import Time
from lib.ros.vendor.geometry_msgs.msg import Point
from lib.ros.vendor.std_msgs.msg import Header
assert Header is lib.ros.vendor.std_msgs.msg.Header is vendor.std_msgs.msg.Header
header = Header(stamp=Time(sec=1), frame_id="map")
track = Track(header=header, points=[Point(x=2.0)], part=Part(times=[Time(sec=3)]))
"""


def test_it_works_where_nothing_is_installed(library, only_numpy):
    code = """
for order in ("little", "big"):
    assert Track.deserialize(track.serialize(byteorder=order)) == track
assert Track.from_dict(track.to_dict()) == track
track.validate()
assert Track(header=header, check_fields=True).header is header
assert type(Track().header) is type(Track.deserialize(track.serialize()).header) is Header
print(Header.__module__)
import pydoc, pkgutil, importlib
assert "frame_id" in pydoc.render_doc(Header)
for module in pkgutil.walk_packages(vendor.__path__, "lib.ros.vendor."):
    importlib.import_module(module.name)
"""
    assert prints(USE + code, library, only_numpy) == ["lib.ros.vendor.std_msgs.msg._header"]


def test_services_and_actions_work_where_nothing_is_installed(library, only_numpy):
    code = """
from lib.ros import vendor
from lib.ros.action import Go
from lib.ros.srv import Ask
event = Ask.Event(request=[Ask.Request()])
assert Ask.Event.deserialize(event.serialize()) == event
assert type(event.info) is vendor.service_msgs.msg.ServiceEventInfo
answer = Go.Impl.SendGoalService.Response()
assert type(answer.stamp) is vendor.builtin_interfaces.msg.Time
assert Go.Impl.CancelGoalService is vendor.action_msgs.srv.CancelGoal
assert Go.Impl.GoalStatusMessage is vendor.action_msgs.msg.GoalStatusArray
cancel = Go.Impl.CancelGoalService.Request()
assert type(cancel).deserialize(cancel.serialize()) == cancel
"""
    assert prints(code, library, only_numpy) == []


def test_an_installed_package_is_the_public_one(library, tmp_path):
    folder = packages(tmp_path, std_msgs=HEADER, builtin_interfaces=TIME)
    code = """
import builtin_interfaces.msg, std_msgs
assert vendor.std_msgs is std_msgs is sys.modules["lib.ros.vendor.std_msgs"]
assert Header is std_msgs.msg.Header and Time is builtin_interfaces.msg.Time
assert type(Track.deserialize(track.serialize()).header) is std_msgs.msg.Header
print(Header.__module__, Point.__module__)
"""
    modules = prints(USE + code, library, folder)
    assert modules == ["std_msgs.msg._header", "lib.ros.vendor.geometry_msgs.msg._point"]


def test_a_type_of_another_hash_is_refused(library, tmp_path):
    other = {"msg/Header.msg": "builtin_interfaces/Time stamp\nstring<=9 frame_id\n"}
    folder = packages(tmp_path, std_msgs=other, builtin_interfaces=TIME)
    hashes = [
        generated.model_of("std_msgs", files).describer.hash("std_msgs/msg/Header")
        for files in (HEADER, other)
    ]
    for code in ("from lib.ros.msg import Track", "import lib.ros.vendor.std_msgs"):
        error = fails(code, library, folder)
        assert "MissingPackageError: track_msgs uses" in error
        assert "std_msgs/msg/Header" in error
        assert all(digest in error for digest in hashes)
        assert str(folder / "std_msgs") in error
    nested = packages(tmp_path / "nested", std_msgs=HEADER, builtin_interfaces={
        "msg/Time.msg": "int64 sec\nuint32 nanosec\n"
    })  # fmt: skip
    error = fails("from lib.ros.msg import Track; Track().serialize()", library, nested)
    assert "builtin_interfaces/msg/Time" in error


HALF = {
    "a folder": ({"std_msgs/note.txt": ""}, "has no such type"),
    "a source tree": ({"std_msgs/msg/Header.msg": "int8 x\n"}, "has no such type"),
    "a package without messages": ({"std_msgs/__init__.py": ""}, "has no such type"),
    "a module": ({"std_msgs.py": ""}, "has no such type"),
    "other messages": (
        {"std_msgs/__init__.py": "", "std_msgs/msg/__init__.py": ""},
        "has no such type",
    ),
    "a broken package": ({"std_msgs/__init__.py": "1 / 0"}, "ZeroDivisionError"),
    "broken messages": (
        {"std_msgs/__init__.py": "", "std_msgs/msg/__init__.py": "1 / 0"},
        "ZeroDivisionError",
    ),
    "a package that misses another": (
        {"std_msgs/__init__.py": "import no_such_package"},
        "No module named 'no_such_package'",
    ),
    "messages that miss others": (
        {"std_msgs/__init__.py": "", "std_msgs/msg/__init__.py": "import std_msgs.msg.no"},
        "No module named 'std_msgs.msg.no'",
    ),
}


@pytest.mark.parametrize("half", HALF)
def test_half_a_package_is_no_reason_for_a_copy(half, library, tmp_path):
    files, error = HALF[half]
    write(tmp_path, files)
    code = "from lib.ros.msg import Track"
    assert error in fails(code, library, tmp_path)
    again = f"try:\n    {code}\nexcept Exception:\n    {code}"
    assert error in fails(again, library, tmp_path), "the second attempt is no other"


def test_it_is_decided_once(library, tmp_path):
    folder = packages(tmp_path, std_msgs=HEADER, builtin_interfaces=TIME)
    code = f"""
sys.path.insert(0, {str(folder)!r})
import importlib
for module in (vendor, vendor.std_msgs, vendor.std_msgs.msg, sys.modules[Track.__module__]):
    importlib.reload(module)
import std_msgs.msg
assert vendor.std_msgs.msg.Header is not std_msgs.msg.Header
assert Header.__module__.startswith(vendor.std_msgs.__name__)
assert std_msgs.msg.Header(frame_id="map", stamp=header.stamp) == header
"""
    assert prints(USE + code, library) == []


def test_threads_that_import_at_once_get_the_same_classes(library, tmp_path):
    folder = packages(tmp_path, std_msgs=HEADER, builtin_interfaces=TIME)
    code = """
sys.setswitchinterval(1e-6)
import importlib, threading
begin, classes, errors = threading.Barrier(8), set(), []
def work(number):
    begin.wait()
    try:
        if number % 2:
            classes.add(importlib.import_module("lib.ros.vendor.std_msgs.msg").Header)
        else:
            classes.add(type(importlib.import_module("lib.ros.msg").Track().header))
    except BaseException as error:
        errors.append(error)
threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
for thread in threads: thread.start()
for thread in threads: thread.join()
assert not errors, errors
assert len(classes) == 1, classes
"""
    assert prints(code, library) == prints(code, library, folder) == []


PICKLE = """
import pickle

class Mine(Header):
    def __init__(self, *values, **named):
        super().__init__(*values, **named)
        self.note = "here"
path, other = sys.argv[1], sys.argv[2:]
checked = Track(header=header, points=track.points, part=track.part, check_fields=True)
mine = Track(header=Mine(frame_id="mine"))
for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
    assert pickle.loads(pickle.dumps([track, checked, mine], protocol)) == [track, checked, mine]
if other:
    with open(other[0], "rb") as file:
        read = pickle.load(file)
    assert read == [track, checked, mine]
    assert [type(each.header) for each in read] == [Header, Header, Mine]
    assert type(read[0].part.times[0]) is Time
    assert (read[1]._check_fields, read[2].header.note) == (True, "here")
    read[0].header.frame_id = read[2].header.frame_id = "assigned"
    assert read[0].serialize() != track.serialize()
with open(path, "wb") as file:
    pickle.dump([track, checked, mine], file)
"""


def test_pickles_can_be_read_with_and_without_installed_packages(library, tmp_path):
    folder = packages(tmp_path, std_msgs=HEADER, builtin_interfaces=TIME)
    alone, beside = str(tmp_path / "alone.pickle"), str(tmp_path / "beside.pickle")

    code = f"sys.argv = ['', {alone!r}]\n"
    assert prints(code + USE + PICKLE, library) == []
    code = f"sys.argv = ['', {beside!r}, {alone!r}]\n"
    assert prints(code + USE + PICKLE, library, folder) == []
    code = f"sys.argv = ['', {alone!r}, {beside!r}]\n"
    assert prints(code + USE + PICKLE, library) == []


@pytest.fixture(scope="module", params=["carried", "installed"])
def other_library(request, tmp_path_factory):
    """A folder with another library, in both modes of the runtime."""
    folder = tmp_path_factory.mktemp("other")
    write(folder / "files", {"msg/Bee.msg": "std_msgs/Header[] headers\n"})
    write(folder, {"pyproject.toml": f'[tool.idlc]\nruntime = "{request.param}"\n'})
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        gen("files", "out/bees", "--vendor-deps", package="bee_msgs")
    assert (folder / "out/bees/_idlc").exists() == (request.param == "carried")
    if request.param == "installed":
        shutil.copytree(ROOT / "idlc/runtime", folder / "out/idlc_runtime")
    return folder / "out"


SHARE = """
from bees.msg import Bee
from bees.vendor.std_msgs.msg import Header as Other
assert Other is not Header
other = Other(stamp=header.stamp, frame_id="map")
assert header == other and other == header
other.frame_id = "x"
assert header != other and other != header
assert header != vendor.geometry_msgs.msg.Point() and header != None and not header == "map"
mixed = Track(header=other, check_fields=True)
assert mixed == Track(header=Header(stamp=header.stamp, frame_id="x"))
assert Track.deserialize(mixed.serialize()) == mixed
bee = Bee(headers=[header, other], check_fields=True)
assert Bee.deserialize(bee.serialize()) == bee == Bee.from_dict(bee.to_dict())
import pickle
assert pickle.loads(pickle.dumps((bee, mixed))) == (bee, mixed)
"""


def test_two_libraries_pass_values_to_each_other(library, other_library):
    assert prints(USE + SHARE, library, other_library) == []


def test_types_of_one_name_and_another_hash_are_unequal(library, tmp_path):
    write(tmp_path / "files", {"msg/Bee.msg": "std_msgs/Header header\n"})
    write(
        tmp_path / "std_msgs",
        {"msg/Header.msg": "builtin_interfaces/Time stamp\nint8[] frame_id\n"},
    )
    out = tmp_path / "out/bees"
    gen(tmp_path / "files", out, "--vendor-deps", "-I", str(tmp_path), package="bee_msgs")
    code = """
from bees.vendor.std_msgs.msg import Header as Other
assert Other(stamp=header.stamp) != Header(stamp=header.stamp)
assert Header().__eq__(Other()) is NotImplemented
try:
    Track(header=Other(), check_fields=True)
except AssertionError as error:
    print(str(error).partition(":")[0])
"""
    assert prints(USE + code, library, out.parent) == ["header"]


# what gen does with the files


def tree(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_changing_the_place_removes_what_was_in_the_other(interfaces, tmp_path, capsys):
    out = tmp_path / "out/track_msgs"
    gen(interfaces, out, "--vendor-deps=beside")
    record = json.loads((out / "idlc.lock").read_text())
    assert {path.name for path in out.parent.iterdir()} == {"track_msgs", *record["vendored"]}
    gen(interfaces, out, "--vendor-deps=beside", "--check")
    assert main(["gen", str(interfaces), "-o", str(out), "--package", "track_msgs", "--check"]) == 1
    assert "it was written with `--vendor-deps=beside`" in capsys.readouterr().err
    words = ["gen", str(interfaces), "-o", str(out), "--package", "track_msgs"]
    for option in ("--vendor-deps", "--vendor-deps=beside"):
        write(tmp_path / "none", {"idlc.lock": (out / "idlc.lock").read_text()})
        assert main([*words[:3], str(tmp_path / "none"), *words[4:], option, "--check"]) == 1
        assert f"{option}`" in capsys.readouterr().err
    gen(interfaces, out, "--vendor-deps")
    said = capsys.readouterr()
    assert f"`{out.parent}/std_msgs` is removed" in said.err
    assert [path.name for path in out.parent.iterdir()] == ["track_msgs"]
    gen(interfaces, out, "--vendor-deps", "--check")
    gen(interfaces, out, "--vendor-deps")
    assert "(unchanged)" in capsys.readouterr().out
    private = tree(out)
    gen(interfaces, out)
    assert not any("vendor" in path for path in tree(out))
    gen(interfaces, out, "--vendor-deps")
    assert tree(out) == private


def test_what_others_import_and_what_was_edited_stays_beside(interfaces, tmp_path, capsys):
    out = tmp_path / "out/track_msgs"
    gen(interfaces, out, "--vendor-deps=beside")
    write(tmp_path / "bees", {"msg/Bee.msg": "std_msgs/Header header\n"})
    gen(tmp_path / "bees", tmp_path / "out/bee_msgs", package="bee_msgs")
    edited = tmp_path / "out/service_msgs/msg/_service_event_info.py"
    before = edited.read_text()
    edited.write_text(f"{before}#\n")
    words = ["gen", str(interfaces), "-o", str(out), "--package", "track_msgs", "--vendor-deps"]
    assert main(words) == 1
    assert "IDL613" in capsys.readouterr().err
    assert (tmp_path / "out/geometry_msgs/msg/_point.py").exists()
    edited.write_text(before)
    assert main(words) == 0
    assert {path.name for path in out.parent.iterdir()} == {
        "bee_msgs",
        "builtin_interfaces",
        "std_msgs",
        "track_msgs",
    }


def test_a_type_that_is_no_longer_used_is_removed(tmp_path):
    write(tmp_path / "files", {"msg/A.msg": "geometry_msgs/Point p\nstd_msgs/Header h\n"})
    out = tmp_path / "out/a_msgs"
    gen(tmp_path / "files", out, "--vendor-deps", package="a_msgs")
    write(tmp_path / "files", {"msg/A.msg": "std_msgs/Header h\n"})
    gen(tmp_path / "files", out, "--vendor-deps", package="a_msgs")
    assert not (out / "_vendor/geometry_msgs").exists()
    assert not (out / "vendor/geometry_msgs").exists()


def test_the_option_takes_no_argument_and_settings_say_the_same(interfaces, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(interfaces, "interfaces")
    assert main(["gen", "--package", "a_msgs", "-o", "one", "--vendor-deps", "interfaces"]) == 0
    for value, beside in (("true", False), ('"beside"', True)):
        table = f"[tool.idlc]\nout = 'two/b_msgs'\npackage = 'b_msgs'\nvendor-deps = {value}\n"
        write(tmp_path, {"pyproject.toml": table})
        assert main(["gen", "interfaces"]) == 0
        assert (tmp_path / "two/std_msgs").exists() is beside
        assert (tmp_path / "two/b_msgs/_vendor").exists() is not beside
        assert main(["gen", "interfaces", "--check"]) == 0
    write(tmp_path, {"pyproject.toml": "[tool.idlc]\nvendor-deps = 'private'\n"})
    assert main(["gen", "interfaces", "-o", "three"]) == 2


def test_several_packages_each_come_with_what_they_use(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in (("a_msgs", "std_msgs/Header h\n"), ("b_msgs", "a_msgs/A a\n")):
        manifest = f"<package><name>{name}</name></package>"
        file = f"src/{name}/msg/{name[0].upper()}.msg"
        write(tmp_path, {f"src/{name}/package.xml": manifest, file: text})
    assert main(["gen", "src", "-o", "lib/ros", "--vendor-deps"]) == 0
    use = "from {0}b_msgs.msg import B; m = B(); assert B.deserialize(m.serialize()) == m; "
    use += "print(type(m.a).__module__)"
    at_the_top, inside = "a_msgs.msg._a", "lib.ros.b_msgs.vendor.a_msgs.msg._a"
    assert prints(use.format(""), "lib/ros") == [at_the_top]
    assert prints(use.format("lib.ros."), ".") == [inside]


@pytest.mark.long
def test_type_checkers_see_the_copies(library, tmp_path):
    shutil.copytree(library / "lib", tmp_path / "lib")
    write(tmp_path, {"lib/__init__.py": "", "use.py": USE})
    write(tmp_path, {"wrong.py": USE + "Header(frame_id=track.points[0].x)\n"})
    write(tmp_path, {"pyrightconfig.json": '{"typeCheckingMode": "standard"}'})
    checkers = (
        ("mypy", "--strict", "-p", "lib", "-m"),
        ("basedpyright", "--pythonpath", sys.executable, "lib"),
    )
    for name, *options in checkers:
        for module, status in (("use", 0), ("wrong", 1)):
            file = module if name == "mypy" else f"{module}.py"
            command = [sys.executable, "-m", name, *options, file]
            ended, said = programs.ended(*command, cwd=tmp_path)
            assert ended == status, said
