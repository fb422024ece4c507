"""Libraries whose classes hatchling and setuptools compile while they build them."""

import os
import subprocess
import sys
import tarfile
import time
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from hatchling import build as hatchling

from idlc.cli.main import main
from idlc.project import prefixes
from idlc.version import RUNTIME
from tests.build.test_hooks import tree, write
from tests.support import programs
from tests.support.paths import ROOT

IDLC = """\
[tool.idlc]
paths = ["interfaces"]
package = "track_msgs"
out = "src/trackkit/ros"
vendor-deps = true
"""
PROJECT = '[project]\nname = "trackkit"\nversion = "1.0"\n'
HATCHLING = """\
[build-system]
requires = ["hatchling", "idlc"]
build-backend = "hatchling.build"
[tool.hatch.build.hooks.idlc]
"""
SETUPTOOLS = """\
[build-system]
requires = ["setuptools", "idlc"]
build-backend = "setuptools.build_meta"
"""
FILES = {
    "interfaces/msg/Track.msg": "std_msgs/Header header\ngeometry_msgs/Point[] points\n",
    "src/trackkit/__init__.py": "",
}
CLASSES = {
    "__init__.py",
    "_idlc/__init__.py",
    "_type_data.py",
    "_vendor/std_msgs/msg/_header.py",
    "idlc.lock",
    "msg/__init__.py",
    "msg/_track.py",
    "py.typed",
    "vendor/std_msgs/msg.py",
}
USE = """
import pickle
from trackkit.ros.msg import Track
from trackkit.ros.vendor.std_msgs.msg import Header

track = Track(header=Header(frame_id="map"))
assert pickle.loads(pickle.dumps(Track.deserialize(track.serialize()))) == track
"""


def with_hatchling(folder):
    """Build a wheel, and return the paths of what is in it."""
    with zipfile.ZipFile(folder / hatchling.build_wheel(str(folder))) as wheel:
        names = wheel.namelist()
        wheel.extractall(folder)  # noqa: S202 - it is our own
    assert len(names) == len(set(names))


def with_setuptools(folder):
    """Build what a wheel would hold; setuptools itself knows wheels from 70 on."""
    (folder / "build").mkdir(parents=True, exist_ok=True)
    code = "from setuptools import setup; setup()"
    words = ["-q", "build", "--build-base", folder / "build", "--build-lib", folder]
    words = [sys.executable, "-c", code, *words]
    status, said = programs.ended(*words, cwd=Path.cwd())
    sys.stderr.write(said)
    if status:
        raise SystemExit(status)


BUILDS = {"hatchling": (with_hatchling, HATCHLING), "setuptools": (with_setuptools, SETUPTOOLS)}


@pytest.fixture(params=BUILDS)
def build(request, tmp_path, monkeypatch):
    """The folder of a library, which is the working folder, and what builds it."""
    function, settings = BUILDS[request.param]
    folder = write(tmp_path / "project", {**FILES, "pyproject.toml": settings + PROJECT + IDLC})
    monkeypatch.chdir(folder)
    return function


def change(old, new):
    path = Path("pyproject.toml")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def built(build, folder):
    """Return the files of the library's package by their paths, without those of wheels."""
    build(folder)
    return {
        path.relative_to(folder / "trackkit").as_posix(): path.read_text()
        for path in (folder / "trackkit").rglob("*")
        if path.is_file()
    }


def own(files):
    """Return the files of a project, without what setuptools always writes."""
    return {path: data for path, data in files.items() if ".egg-info" not in str(path)}


def test_a_library_is_built_with_classes_that_nobody_committed(build, tmp_path):
    before = tree(Path.cwd())
    files = built(build, tmp_path / "one")
    assert {f"ros/{path}" for path in CLASSES} <= files.keys()
    assert own(tree(Path.cwd())) == before, "nothing is written into the source folder"
    code = f"import sys; sys.path.insert(0, {str(tmp_path / 'one')!r}){USE}"
    programs.run(sys.executable, "-I", "-S", "-c", code, cwd=tmp_path)
    assert main(["gen"]) == 0
    generated = Path("src/trackkit")
    assert files == {
        path.relative_to(generated).as_posix(): path.read_text()
        for path in generated.rglob("*")
        if path.is_file()
    }


def test_classes_in_the_folder_are_compiled_anew(build, tmp_path):
    fresh = built(build, tmp_path / "one")
    write(Path.cwd(), {"interfaces/msg/Old.msg": "int8 old\n"})
    assert main(["gen"]) == 0
    Path("interfaces/msg/Old.msg").unlink()
    Path("src/trackkit/ros/msg/_track.py").write_text("edited\n")
    files = built(build, tmp_path / "two")
    assert {path: files[path] for path in fresh} == fresh
    Path("src/trackkit/ros/__init__.py").write_text('"""Tracks for ROS."""\n')
    assert built(build, tmp_path / "three")["ros/__init__.py"] == '"""Tracks for ROS."""\n'


KEYS = IDLC.splitlines()[1:]


@pytest.mark.parametrize(
    "table", ["\nidlc.".join(["[tool]", *KEYS]), f"[tool]\nidlc = {{ {', '.join(KEYS)} }}"]
)
def test_the_settings_may_be_keys_of_another_table(table, build, tmp_path):
    change(IDLC, f"{table}\n")
    assert "ros/msg/_track.py" in built(build, tmp_path)


@pytest.mark.parametrize("build", ["setuptools"], indirect=True)
def test_a_folder_of_setuptools_keeps_no_old_classes(build, tmp_path):
    write(Path.cwd(), {"interfaces/msg/Old.msg": "int8 old\n"})
    assert "ros/msg/_old.py" in built(build, tmp_path / "one")
    Path("interfaces/msg/Old.msg").unlink()
    text = '"""Tracks for ROS."""\n'
    write(Path.cwd(), {"src/trackkit/ros/__init__.py": text})
    later = time.time() + 2  # setuptools compares whole seconds
    os.utime("src/trackkit/ros/__init__.py", (later, later))
    files = built(build, tmp_path / "one")
    assert files["ros/__init__.py"] == text
    assert "ros/msg/_old.py" not in files
    assert "ros/msg/_track.py" in files


def test_classes_can_be_in_a_package_with_code_of_its_own(build, tmp_path):
    change('"src/trackkit/ros"', '"src/trackkit"')
    write(Path.cwd(), {"src/trackkit/__init__.py": "HERE = 1\n", "src/trackkit/more.py": ""})
    files = built(build, tmp_path / "one")
    assert CLASSES | {"more.py"} <= files.keys()
    assert files["__init__.py"] == "HERE = 1\n"


def test_a_library_may_consist_of_classes(build, tmp_path):
    change('"src/trackkit/ros"', '"src/trackkit"')
    Path("src/trackkit/__init__.py").unlink()
    Path("src/trackkit").rmdir()
    with Path("pyproject.toml").open("a") as file:
        file.write('[tool.hatch.build.targets.wheel]\npackages = ["src/trackkit"]\n')
    assert built(build, tmp_path / "one").keys() >= CLASSES


def test_the_build_takes_the_settings_of_gen(build, tmp_path, capfd):
    write(Path.cwd(), {"interfaces/old/Old.msg": "int8 old\n"})
    change(IDLC, IDLC + 'exclude = ["old"]\nruntime = "installed"\n')
    files = built(build, tmp_path / "one")
    assert "ros/_idlc.py" in files
    assert not [path for path in files if "old" in path or path.startswith("ros/_idlc/")]
    assert "class Track(" in files["ros/msg/_track.py"]
    change('version = "1.0"\n', f'version = "1.0"\ndependencies = ["numpy", "{RUNTIME}"]\n')
    said = capfd.readouterr().err
    built(build, tmp_path / "two")
    assert f'add "{RUNTIME}" to `dependencies`' in said
    assert "IDL459" not in capfd.readouterr().err


@pytest.mark.parametrize("build", ["hatchling"], indirect=True)
def test_the_project_alone_decides_about_the_distribution(build, tmp_path, monkeypatch):
    monkeypatch.setattr(prefixes, "ament_prefixes", tuple)
    files = built(build, tmp_path / "one")
    monkeypatch.setenv("ROS_DISTRO", "lyrical")
    assert built(build, tmp_path / "two") == files
    change(IDLC, IDLC + 'distro = "lyrical"\n')
    assert built(build, tmp_path / "three") != files


@pytest.mark.parametrize("build", ["hatchling"], indirect=True)
def test_arrays_need_numpy(build, tmp_path, capfd):
    built(build, tmp_path / "one")
    assert "numpy" not in capfd.readouterr().err
    write(Path.cwd(), {"interfaces/msg/Track.msg": "geometry_msgs/PoseWithCovariance pose\n"})
    built(build, tmp_path / "two")
    assert 'hint: add "numpy" to `dependencies`' in capfd.readouterr().err
    change('version = "1.0"\n', 'version = "1.0"\ndependencies = ["numpy>=1.24"]\n')
    built(build, tmp_path / "three")
    assert "IDL459" not in capfd.readouterr().err


REFUSED = {
    "no paths": ('paths = ["interfaces"]\n', "", "[tool.idlc] has no `paths`"),
    "no out": ('out = "src/trackkit/ros"\n', "", "[tool.idlc] has no `out`"),
    "an unknown setting": ("package =", "pakage =", "did you mean `package`?"),
    "a folder above": ("src/trackkit/ros", "../ros", '| out = "../ros"\n   | ^^^'),
    "the folder itself": ("src/trackkit/ros", ".", "`out`, which is `.`"),
    "an absolute folder": ("src/trackkit/ros", "/srv/ros", "`out`, which is `/srv/ros`"),
    "no identifier": ("src/trackkit/ros", "src/track-kit", "`out`, which is `src/track-kit`"),
    "a keyword": ("src/trackkit/ros", "src/trackkit/class", "`out`, which is `src/trackkit/class`"),
    "a file": ("src/trackkit/ros", "interfaces/msg/Track.msg", "`out`, which is `interfaces/msg"),
    "a file without a suffix": (
        "src/trackkit/ros",
        "src/trackkit/file",
        "`out`, which is `src/trackkit",
    ),
    "code": ("src/trackkit/ros", "src/a') or exit('", "`out`, which is `src/a') or exit('`"),
    "packages beside": ("vendor-deps = true", 'vendor-deps = "beside"', "`vendor-deps` is"),
    "no such folder": ('["interfaces"]', '["interface"]', "did you mean `interfaces`?"),
    "no name of a package": ('"track_msgs"', '"std_msgs/../x"', "IDL607"),
}


@pytest.mark.parametrize(
    ("build", "case"),
    [
        *(("hatchling", case) for case in REFUSED),
        *(("setuptools", case) for case in ("no out", "a folder above", "code")),
    ],
    indirect=["build"],
)
def test_what_is_wrong_ends_the_build_with_a_report(build, case, tmp_path, capfd):
    old, new, expected = REFUSED[case]
    change(old, new)
    write(Path.cwd(), {"src/trackkit/file": ""})
    with pytest.raises(SystemExit):
        build(tmp_path / "dist")
    said = capfd.readouterr().err
    assert expected in said
    assert "idlc: nothing was built, see above" in said
    assert "Traceback" not in said
    assert not [*tmp_path.rglob("_track.py")]


def test_a_rejected_interface_is_shown(build, tmp_path, capfd):
    write(Path.cwd(), {"interfaces/msg/Track.msg": "flot32 speed\n"})
    with pytest.raises(SystemExit):
        build(tmp_path / "dist")
    said = capfd.readouterr().err
    assert "error[IDL201]: unknown type `flot32`\n --> interfaces/msg/Track.msg:1:1" in said


def test_the_hook_may_be_named_elsewhere(tmp_path, monkeypatch, capfd):
    head, _, _ = HATCHLING.partition(', "idlc"')
    project = head + ']\nbuild-backend = "hatchling.build"\n' + PROJECT
    write(tmp_path, {**FILES, "hatch.toml": "[build.hooks.idlc]\n", "pyproject.toml": project})
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        with_hatchling(tmp_path)
    assert "[tool.idlc] has no `paths`" in capfd.readouterr().err


LAYOUTS = {
    "another name in the wheel": (
        "hatchling",
        '[tool.hatch.build.targets.wheel.sources]\n"src/trackkit" = "acme/track"\n',
        "src/trackkit/ros",
        "acme/track/ros",
    ),
    "beside the package": ("hatchling", "", "src/track_msgs", "track_msgs"),
    "a folder of setuptools": (
        "setuptools",
        '[tool.setuptools]\npackages = ["acme"]\npackage-dir = { acme = "src/trackkit" }\n',
        "src/trackkit/ros",
        "acme/ros",
    ),
    "beside a package of setuptools": ("setuptools", "", "src/track_msgs", "track_msgs"),
}


@pytest.mark.parametrize(
    ("build", "case"),
    [(build, case) for case, (build, *_) in LAYOUTS.items()],
    indirect=["build"],
)
def test_classes_are_where_the_build_tool_puts_their_folder(build, case, tmp_path):
    _, settings, out, expected = LAYOUTS[case]
    change(PROJECT, PROJECT + settings)
    change('"src/trackkit/ros"', f'"{out}"')
    build(tmp_path / "one")
    (path,) = (tmp_path / "one").rglob("msg/_track.py")
    assert path.relative_to(tmp_path / "one").as_posix() == f"{expected}/msg/_track.py"


def test_settings_of_the_hook_are_those_of_hatchling(tmp_path, monkeypatch, capfd):
    write(tmp_path, {**FILES, "pyproject.toml": HATCHLING + 'out = "x"\n' + PROJECT + IDLC})
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        with_hatchling(tmp_path)
    assert "unknown setting `out` of the build hook idlc" in capfd.readouterr().err
    change('out = "x"\n', "enable-by-default = false\n")
    with_hatchling(tmp_path)
    assert not (tmp_path / "trackkit/ros").exists()


def sdist_of_hatchling(folder):
    return folder / hatchling.build_sdist(str(folder))


def sdist_of_setuptools(folder):
    code = "from setuptools import setup; setup()"
    programs.run(sys.executable, "-c", code, "-q", "sdist", "-d", folder, cwd=Path.cwd())
    (path,) = folder.glob("*.tar.gz")
    return path


@pytest.mark.parametrize(
    ("settings", "sdist"),
    [
        (HATCHLING + '[tool.hatch.build.targets.sdist]\nonly-include = ["src"]\n',
         sdist_of_hatchling),
        (SETUPTOOLS, sdist_of_setuptools),
    ],
)  # fmt: skip
def test_a_source_distribution_has_the_interfaces(settings, sdist, tmp_path, monkeypatch):
    folder = write(tmp_path / "project", {**FILES, "pyproject.toml": settings + PROJECT + IDLC})
    write(folder, {"interfaces/package.xml": "<package/>", "interfaces/README": "no interface"})
    write(folder, {"others/dep_msgs/msg/Dep.msg": "", "others/dep_msgs/package.xml": "<package/>"})
    write(tmp_path, {"secret.msg": "int8 secret\n", "outside/Far.msg": "int8 far\n"})
    (folder / "interfaces/msg/Secret.msg").symlink_to(tmp_path / "secret.msg")
    (folder / "interfaces/msg/Circle.msg").symlink_to("Circle.msg")
    (folder / "interfaces/msg/Gone.msg").symlink_to("Nowhere.msg")
    change_paths = IDLC.replace('["interfaces"]', '["interfaces", "../outside"]')
    (folder / "pyproject.toml").write_text(
        f'{settings}{PROJECT}{change_paths}include = ["others"]\n'
    )
    monkeypatch.chdir(folder)
    with tarfile.open(sdist(tmp_path / "dist")) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    names = {name for name in names if name.endswith((".msg", ".xml", ".py"))}
    others = {"others/dep_msgs/msg/Dep.msg", "others/dep_msgs/package.xml"}
    assert names - {"setup.py"} == {*FILES, "interfaces/package.xml", *others}


UNCONCERNED = {
    "without [tool.idlc]": (SETUPTOOLS + PROJECT, None),
    "idlc is not required": (SETUPTOOLS.replace(', "idlc"', "") + PROJECT + IDLC, None),
    "idlc-runtime is": (SETUPTOOLS.replace('"idlc"', '"idlc-runtime"') + PROJECT + IDLC, None),
    "no build-system": (PROJECT + IDLC, None),
    "no table": ('[tool]\nidlx = 3\n[build-system]\nrequires = ["idlc==1"]\n' + PROJECT, None),
    "no settings": ("[tool]\nidlc = 3\n" + PROJECT, None),
    "no pyproject.toml": (None, "from setuptools import setup; setup(name='trackkit')"),
}


@pytest.mark.parametrize("case", UNCONCERNED)
def test_builds_of_others_are_as_without_idlc(case, tmp_path, monkeypatch):
    text, code = UNCONCERNED[case]
    write(tmp_path, FILES)
    if text is not None:
        write(tmp_path, {"pyproject.toml": text})
    monkeypatch.chdir(tmp_path)
    code = code or "from setuptools import setup; setup()"
    code += "; import sys; print(*sorted({'msgspec', 'lark', 'click'} & sys.modules.keys()))"
    words = ["-q", "build", "--build-base", "out"]
    said = programs.run(sys.executable, "-c", code, *words, cwd=tmp_path)
    assert not [*tmp_path.rglob("_track.py")]
    if case in ("without [tool.idlc]", "no table", "no pyproject.toml"):
        assert "msgspec" not in said, "idlc is not imported"


ENTRY_POINTS = """
from importlib.metadata import distribution
from setuptools import setup

for entry_point in distribution("idlc").entry_points:
    entry_point.load()
setup(name="other")
"""


def test_builds_of_others_work_where_pth_files_are_not_run(tmp_path):
    """An editable idlc on PYTHONPATH is found by its entry points alone."""
    installed = [metadata.distribution(name) for name in ("idlc", "setuptools")]
    path = os.pathsep.join(str(distribution.locate_file("")) for distribution in installed)
    words = ["-S", "-c", ENTRY_POINTS, "--name"]
    assert programs.run_with(sys.executable, *words, cwd=tmp_path, PYTHONPATH=path) == "other\n"


@pytest.mark.parametrize("text", ["[tool.idlc]\n[", "\xff", "tool.idlc" * 10**5, "[tool.idlc]\n"])
def test_the_hook_leaves_broken_settings_to_setuptools(text, tmp_path, monkeypatch):
    from idlc.build import compile_library_at_build

    class Distribution:
        pass

    (tmp_path / "pyproject.toml").write_bytes(text.encode("latin-1"))
    monkeypatch.chdir(tmp_path)
    distribution = Distribution()
    compile_library_at_build(distribution)
    assert not vars(distribution)


def test_a_setup_py_that_compiles_does_so_once(tmp_path):
    write(
        tmp_path,
        {
            "pyproject.toml": SETUPTOOLS + IDLC.replace("src/trackkit/ros", "track_msgs"),
            "interfaces/msg/Track.msg": "int8 a\n",
            "track_msgs/__init__.py": "",
            "setup.py": "from setuptools import setup\n"
            "setup(name='track_msgs', packages=['track_msgs'], idlc_interfaces=True)\n",
        },
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "ROS_DISTRO": "jazzy"}
    words = [sys.executable, "setup.py", "-v", "build"]
    said = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert "build_idlc" not in said.stdout
    assert (tmp_path / "track_msgs/msg/_track.py").exists()
