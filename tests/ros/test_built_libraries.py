"""What colcon and pip install is what C++ tools load, and what `ros2 run` and launch files find."""

import os
import platform
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import msgspec
import pytest

from tests.support import native, programs
from tests.support.paths import ROOT

pytestmark = pytest.mark.long

#: Where Python finds idlc and what it needs.
SITE = str(Path(msgspec.__file__).parents[1])
IDLC = f"{ROOT}:{SITE}"
INDEX = Path(native.INDEX, "demo")
SHARE = Path("share", "demo")
LIBRARY = Path("lib", "libdemo__rosidl_typesupport_cpp.so")
FIELDS = Path("lib", "libdemo__rosidl_typesupport_introspection_cpp.so")
MESSAGES = ("demo/msg/Drive", "demo/srv/Stop_Event", "demo/action/Park_FeedbackMessage")


def run(*command, cwd, **environment):
    return programs.run(*command, cwd=cwd, environment={**os.environ, **environment})


def idlc(*words, cwd):
    return run(sys.executable, "-m", "idlc", *words, cwd=cwd, PYTHONPATH=str(ROOT))


@pytest.fixture(scope="module")
def ask(tmp_path_factory):
    """Return a function that does what C++ tools do with types of a prefix; it returns hashes."""
    program = native.built(tmp_path_factory.mktemp("ask"))

    def ask(prefix, names=MESSAGES):
        said = run(program, *names, cwd=prefix, AMENT_PREFIX_PATH=str(prefix))
        assert f"asked for {len(names)}" in said
        rows = [line.split() for line in said.splitlines() if "::" in line]
        return {row[0]: f"RIHS01_{row[2]}" for row in rows if row[0] in names and len(row) == 5}

    return ask


@pytest.fixture(scope="module")
def scaffolded(tmp_path_factory):
    """Return a new package with interfaces of each kind and a command."""
    folder = tmp_path_factory.mktemp("scaffolded")
    idlc("scaffold", "package", "demo", cwd=folder)
    package = folder / "demo"
    for words in (
        ["msg", "Drive", "float32 speed", "string note"],
        ["srv", "Stop", "bool now", "---", "string answer"],
        ["action", "Park", "string place", "---", "bool done", "---", "float32 distance"],
    ):
        idlc("scaffold", "interface", *words, cwd=package)
    (package / "demo" / "hello.py").write_text("def main():\n    print('hello from', __file__)\n")
    setup = package / "setup.py"
    entry = "'console_scripts': [\n            'hello = demo.hello:main',"
    setup.write_text(setup.read_text().replace("'console_scripts': [", entry))
    return package


def hashes(package):
    """Return the hashes that the interfaces of a package have now."""
    lines = idlc("show", ".", "--format", "hash", cwd=package).splitlines()
    found = {name: digest for digest, name in map(str.split, lines)}
    return {name: found[name] for name in MESSAGES}


def change(package, number):
    """Change the interfaces of a package; return their new hashes."""
    with (package / "msg" / "Drive.msg").open("a") as file:
        file.write(f"int32 more{number}\n")
    return hashes(package)


def checked(prefix):
    """Return the status of a check of what is installed, and what it says."""
    command = [sys.executable, "-m", "idlc", "check", "--ament", prefix]
    return programs.ended(*command, cwd=ROOT, environment={**os.environ, "PYTHONPATH": str(ROOT)})


def test_what_rosidl_built_is_in_order():
    status, said = checked(sys.prefix)
    assert (status, said.startswith("no problems in ")) == (0, True), said


def commands(prefix, package="demo"):
    """Return the files that `ros2 run` and launch files start: executable ones below lib/NAME."""
    code = (
        "import sys; from ament_index_python.packages import get_package_prefix as prefix\n"
        f"print(prefix('{package}'))"
    )
    found = run(sys.executable, "-c", code, cwd=prefix, AMENT_PREFIX_PATH=str(prefix)).strip()
    below = Path(found, "lib", package)
    return [path for path in below.rglob("*") if path.is_file() and os.access(path, os.X_OK)]


def test_colcon_builds_it_with_links_and_without_in_any_order(scaffolded, ask, tmp_path):
    package = shutil.copytree(scaffolded, tmp_path / "src" / "demo")
    before = {path for path in package.rglob("*") if "demo/demo/" not in path.as_posix()}
    colcon = [Path(sys.executable).parent / "colcon", "--log-base", "log", "build"]
    prefix = tmp_path / "install" / "demo"
    expected = hashes(package)
    for number, options in enumerate((["--symlink-install"], [], ["--symlink-install"])):
        run(*colcon, *options, cwd=tmp_path, PYTHONPATH=str(ROOT))
        assert ask(prefix) == expected
        for path in (LIBRARY, SHARE / "msg/Drive.json", SHARE / "launch/demo_launch.py", INDEX):
            assert (prefix / path).is_file()
            assert (prefix / path).is_symlink() == bool(options)
        assert [path.name for path in commands(prefix)] == ["hello"]
        assert checked(tmp_path / "install")[0] == 0
        expected = change(package, number)
    status, said = checked(tmp_path / "install")
    assert (status, "is out of date: `demo/msg/Drive` changed" in said) == (1, True)
    after = {path for path in package.rglob("*") if "demo/demo/" not in path.as_posix()}
    assert after == before, "what is built is not part of the source"


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """Return a virtual environment with what builds wheels, and no ROS 2."""
    folder = tmp_path_factory.mktemp("clean") / "venv"
    venv.create(folder, with_pip=True)
    pip = [folder / "bin" / "python", "-m", "pip", "install", "-q", "setuptools", "wheel"]
    run(*pip, cwd=folder, PYTHONPATH="")
    (site,) = folder.glob("lib/python3*/site-packages")
    # after its own packages, so that these are used
    line = "import os, sys; sys.path += filter(None, os.environ.get('BORROWED', '').split(':'))\n"
    (site / "borrowed.pth").write_text(line)
    return folder


@pytest.fixture
def pip(environment, tmp_path):
    """Return a function that runs pip; idlc is importable for builds unless told otherwise."""

    def pip(*words, borrowed=IDLC, path="", **others):
        python = environment / "bin" / "python"
        found = {"BORROWED": borrowed, "PYTHONPATH": path, **others}
        return run(python, "-m", "pip", *words, cwd=tmp_path, **found)

    yield pip
    pip("uninstall", "-q", "-y", "demo")


INSTALL = ("install", "-v", "--no-deps", "--no-build-isolation")


@pytest.mark.parametrize("options", [[], ["-e"]], ids=["installed", "editable"])
def test_pip_installs_libraries_and_commands(options, scaffolded, environment, pip, ask, tmp_path):
    package = shutil.copytree(scaffolded, tmp_path / "demo")
    pip(*INSTALL, *options, package)
    assert ask(environment) == hashes(package)
    (command,) = commands(environment)
    said = run(command, cwd=tmp_path, PYTHONPATH="")
    assert str(package if options else environment) in said
    again = change(package, 1)
    pip(*INSTALL, "--force-reinstall", *options, package)
    assert ask(environment) == again
    pip("uninstall", "-q", "-y", "demo")
    assert not (environment / LIBRARY).exists()
    assert not (environment / "lib" / "demo").exists()


def test_a_wheel_is_for_the_machine_whose_library_it_holds(scaffolded, pip, tmp_path):
    package = shutil.copytree(scaffolded, tmp_path / "demo")
    words = ("wheel", "--no-deps", "--no-build-isolation", "-w", tmp_path, package)
    pip(*words, ROS_DISTRO="jazzy")
    (wheel,) = tmp_path.glob("*.whl")
    tag = rf"(manylinux_2_17|musllinux_1_1)_{platform.machine()}"
    assert re.fullmatch(rf"demo-0\.1\.0-py3-none-{tag}\.whl", wheel.name)
    pip(*words, ROS_DISTRO="humble")
    assert len({*tmp_path.glob("*.whl")}) == 2, "libraries that differ are in wheels that do"


def test_a_package_of_nodes_alone_is_for_every_machine(environment, pip, tmp_path):
    idlc("scaffold", "package", "demo", cwd=tmp_path)
    for options in ({}, {"borrowed": ""}):
        pip("wheel", *INSTALL[2:], "-w", tmp_path, tmp_path / "demo", **options)
        (wheel,) = tmp_path.glob("*.whl")
        assert wheel.name == "demo-0.1.0-py3-none-any.whl"
        pip(*INSTALL, "--force-reinstall", wheel)
        assert (environment / INDEX).is_file()
        wheel.unlink()


def test_without_a_library_the_package_is_not_in_the_index(scaffolded, environment, pip, tmp_path):
    """A recorder that sees it there, and no library, stops."""
    package = shutil.copytree(scaffolded, tmp_path / "demo")
    idlc("gen", cwd=package)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    text = "import platform\nplatform.machine = lambda: 'riscv64'\n"
    (elsewhere / "sitecustomize.py").write_text(text)
    said = pip(*INSTALL, "--force-reinstall", package, borrowed=IDLC, path=str(elsewhere))
    assert "Linux on x86_64 and aarch64" in said
    assert not (environment / INDEX).exists()
    assert not (environment / INDEX.parents[1] / "rosidl_interfaces" / "demo").exists()
    assert not (environment / LIBRARY).exists()
    assert (environment / "share" / "demo" / "msg" / "Drive.msg").is_file()
    code = "from demo.msg import Drive; print(Drive(1.5))"
    said = run(environment / "bin" / "python", "-c", code, cwd=tmp_path, PYTHONPATH=SITE)
    assert "1.5" in said


def built_by_colcon(*options, merged=False):
    def build(package, folder, pip, environment):
        colcon = [Path(sys.executable).parent / "colcon", "--log-base", folder / "log", "build"]
        places = ["--build-base", folder / "build", "--install-base", folder / "install"]
        run(*colcon, *places, *options, "--paths", package, cwd=folder, PYTHONPATH=str(ROOT))
        return folder / "install" / ("" if merged else "demo")

    return build


def installed_by_pip(*options):
    def build(package, folder, pip, environment):
        pip(*INSTALL, *options, package)
        return environment

    return build


def installed_from_an_sdist(package, folder, pip, environment):
    code = "import setuptools.build_meta as b, sys; b.build_sdist(sys.argv[1])"
    python = environment / "bin" / "python"
    run(python, "-c", code, folder, cwd=package, BORROWED=IDLC, PYTHONPATH="")
    (sdist,) = folder.glob("*.tar.gz")
    pip(*INSTALL, sdist)
    return environment


def installed_by_the_backend(package, folder, pip, environment):
    lines = '[build-system]\nrequires = ["idlc"]\nbuild-backend = "idlc.backend"\n'
    (package / "pyproject.toml").write_text(lines)
    (package / "demo" / "hello.py").unlink()
    programs.run("git", "commit", "-qam", "backend", cwd=package)
    pip(*INSTALL, package)
    return environment


def generated(package, folder, pip, environment):
    idlc("gen", package, "--ament", folder / "prefix", cwd=folder)
    return folder / "prefix"


WAYS = {
    "colcon": built_by_colcon(),
    "colcon, links": built_by_colcon("--symlink-install"),
    "colcon, merged": built_by_colcon("--merge-install", merged=True),
    "pip": installed_by_pip(),
    "pip, editable": installed_by_pip("-e"),
    "sdist": installed_from_an_sdist,
    "backend": installed_by_the_backend,
    "gen --ament": generated,
}


def seen_by_ros(prefix):
    """Return the files of a prefix by which ROS 2's tools know the package, and what they hold."""
    return {
        path.relative_to(prefix).as_posix(): path.read_bytes()
        for pattern in (
            "lib/libdemo_*",
            "share/demo/package.xml",
            "share/demo/msg/*",
            "share/demo/srv/*",
            "share/demo/action/*",
            "share/ament_index/resource_index/rosidl_interfaces/*",
            "share/ament_index/resource_index/packages/*",
        )
        for path in prefix.glob(pattern)
    }


@pytest.fixture(scope="module")
def committed(scaffolded, tmp_path_factory):
    """Return the package with its classes, a wide string, and all of it in git."""
    package = shutil.copytree(scaffolded, tmp_path_factory.mktemp("committed") / "demo")
    (package / "msg" / "Drive.msg").write_text("wstring note\n")
    setup = package / "setup.py"  # a file that ROS 2 does not know is installed as it is listed
    old = "data_files=[\n"
    assert old in setup.read_text()
    new = f"{old}        ('share/demo/msg/', ['README.md', 'msg/Drive.msg']),\n"
    setup.write_text(setup.read_text().replace(old, new))
    idlc("gen", cwd=package)
    programs.run("git", "init", "-q", cwd=package)
    for words in (["user.name", "A"], ["user.email", "a@example.com"]):
        programs.run("git", "config", *words, cwd=package)
    programs.run("git", "add", ".", cwd=package)
    programs.run("git", "commit", "-qm", "all", cwd=package)
    return package


@pytest.mark.parametrize("way", WAYS)
def test_each_way_installs_the_same_and_leaves_git_clean(
    way, committed, environment, pip, tmp_path
):
    package = shutil.copytree(committed, tmp_path / "demo")
    prefix = WAYS[way](package, tmp_path, pip, environment)
    found = seen_by_ros(prefix)
    expected = {
        path.relative_to(package).as_posix()
        for kind in ("msg", "srv", "action")
        for path in (package / kind).iterdir()
    }
    listed = found["share/ament_index/resource_index/rosidl_interfaces/demo"].decode().split()
    assert {path for path in listed if not path.endswith(".idl")} == expected
    assert {f"share/demo/{path}" for path in listed} <= found.keys()
    if not way.startswith(("backend", "gen")):
        assert found.pop("share/demo/msg/README.md") == (package / "README.md").read_bytes()
    reference = tmp_path / "reference"
    reference.mkdir()
    expected = seen_by_ros(generated(package, reference, pip, environment))
    for path in [path for path in expected if path.startswith("lib/")]:
        # has the texts of the interfaces that others have here
        assert found.pop(path)[:4] == expected.pop(path)[:4]
    assert found == expected
    assert checked(prefix)[0] == 0
    assert programs.run("git", "status", "--short", cwd=package) == ""


@pytest.mark.parametrize("shell", [None, "sh", "bash", "zsh"])
def test_a_prefix_without_a_build(shell, scaffolded, ask, tmp_path):
    prefix = tmp_path / "a prefix"
    idlc("gen", scaffolded, "--ament", prefix, cwd=tmp_path)
    assert ask(prefix) == hashes(scaffolded)
    code = (
        "from ament_index_python.packages import get_package_share_directory as share\n"
        "from ament_index_python.resources import get_resource\n"
        "from demo.msg import Drive\n"
        "print(share('demo'), get_resource('rosidl_interfaces', 'demo')[0].split(), Drive())"
    )
    if shell is None:
        (site,) = prefix.glob("lib/python3*/site-packages")
        found = {"AMENT_PREFIX_PATH": str(prefix), "PYTHONPATH": str(site)}
        said = run(sys.executable, "-c", code, cwd=tmp_path, **found)
    else:
        if not shutil.which(shell):
            pytest.skip(f"no {shell}")
        line = f'. "./a prefix/setup.{shell}" && "$0" -c "$1"'
        clean = {"AMENT_PREFIX_PATH": "", "PYTHONPATH": ""}
        said = run(shell, "-euc", line, sys.executable, code, cwd=tmp_path, **clean)
    assert f"{prefix}/share/demo" in said
    assert "'action/Park.action', 'action/Park.idl'" in said
    assert "Drive(" in said


def test_a_full_disk_leaves_the_old_library(scaffolded, ask, tmp_path):
    package = shutil.copytree(scaffolded, tmp_path / "demo")
    prefix = tmp_path / "prefix"
    install = [sys.executable, "setup.py", "install_data", "--install-dir", str(prefix)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run(install, cwd=package, env=environment, check=True, capture_output=True)
    (prefix / INDEX).parent.mkdir(parents=True, exist_ok=True)
    old = (prefix / LIBRARY).read_bytes()
    assert ask(prefix) == hashes(package)
    limited = ["bash", "-c", 'ulimit -f 8; "$@"', "bash", *install]  # blocks of 1 KiB
    for number, step in enumerate(("when it is copied", "when it is made")):
        done = subprocess.run(
            limited, cwd=package, env=environment, check=False, capture_output=True
        )
        assert done.returncode != 0, step
        assert b"Traceback" not in done.stderr, step
        assert (prefix / LIBRARY).read_bytes() == old
        change(package, number)
    subprocess.run(install, cwd=package, env=environment, check=True, capture_output=True)
    assert ask(prefix) == hashes(package)
