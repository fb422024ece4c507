"""pip, uv and build have `idlc.backend` build a folder, and what they install works."""

import os
import re
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.build.test_hooks import BUILD, FILES, MANIFEST, tree, write
from tests.repository.test_wheel import Environment, distributions, run
from tests.support.programs import clean_environment, ended

pytestmark = pytest.mark.long

BIN = Path(sys.executable).parent
#: idlc and hatchling of this environment, and no network.
HERE = ["--no-build-isolation", "--no-deps"]
PIP = [sys.executable, "-m", "pip", "install", "--no-index", "--disable-pip-version-check", *HERE]

__all__ = ["distributions"]  # a fixture


@pytest.fixture
def source(tmp_path):
    return write(tmp_path / "demo_msgs", FILES)


@pytest.fixture
def scaffolded(tmp_path):
    """The folder that `idlc scaffold package --interfaces` writes."""
    words = ["scaffold", "package", "--interfaces", "demo_msgs", "Drive", "srv/Ask", "action/Walk"]
    run(sys.executable, "-m", "idlc", *words, cwd=tmp_path)
    return tmp_path / "demo_msgs"


def site(prefix):
    """Return the folder of a prefix that Python imports from."""
    return Path(sysconfig.get_path("purelib", vars={"base": str(prefix)}))


def imported(prefix, cwd):
    """Return what a message of the package in a prefix looks like."""
    code = "import demo_msgs.msg as m; print(m.__file__, m.Drive())"
    environment = {**os.environ, "PYTHONPATH": str(site(prefix))}
    status, said = ended(sys.executable, "-c", code, cwd=cwd, environment=environment)
    assert status == 0, said
    assert said.startswith(str(site(prefix)))
    return said


@pytest.mark.parametrize("options", [[], ["-e"]], ids=["installed", "editable"])
def test_pip_installs_what_is_scaffolded(options, scaffolded, tmp_path):
    before = tree(scaffolded)
    prefix = tmp_path / "prefix"
    command = [*PIP, "--prefix", prefix, *options, scaffolded]
    run(*command, cwd=tmp_path)
    assert "Drive(speed=0.0)" in imported(prefix, tmp_path)
    # what an editable installation has of the interfaces changes as one
    (scaffolded / "msg" / "Drive.msg").write_text("float32 velocity\n")
    assert "Drive(speed=0.0)" in imported(prefix, tmp_path)
    run(*command, "--ignore-installed", cwd=tmp_path)
    assert "Drive(velocity=0.0)" in imported(prefix, tmp_path)
    assert (prefix / "share/demo_msgs/msg/Drive.msg").read_text() == "float32 velocity\n"
    assert (prefix / "lib/libdemo_msgs__rosidl_typesupport_cpp.so").is_file()
    run(sys.executable, "-m", "idlc", "check", "--ament", prefix, cwd=tmp_path)
    assert tree(scaffolded).keys() == before.keys(), "nothing is written into the source folder"


def test_uv_builds_again_when_an_interface_changes(scaffolded, tmp_path):
    prefix = tmp_path / "prefix"
    where = ["--python", sys.executable, "--prefix", prefix, "--cache-dir", tmp_path / "cache"]
    command = [BIN / "uv", "pip", "install", "--offline", *HERE, *where, "-e", scaffolded]
    said = run(*command, cwd=tmp_path)
    assert "+ demo-msgs==0.1.0" in said
    assert "Drive(speed=0.0)" in imported(prefix, tmp_path)
    (scaffolded / "msg" / "Drive.msg").write_text("float32 velocity\n")
    run(*command, cwd=tmp_path)
    assert "Drive(velocity=0.0)" in imported(prefix, tmp_path)
    (scaffolded / "msg" / "Drive.msg").write_text("flot32 velocity\n")
    status, said = ended(*map(str, command), cwd=tmp_path, environment=clean_environment())
    assert status != 0
    assert "error[IDL201]: unknown type `flot32`" in said
    assert "Traceback" not in said


def test_build_writes_both_archives(source, tmp_path):
    before = tree(source)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", tmp_path / "dist"]
    said = run(*command, source, cwd=tmp_path)
    names = sorted(path.name for path in (tmp_path / "dist").iterdir())
    assert "demo_msgs-1.2.3.tar.gz" in names
    assert len(names) == 2
    assert "Successfully built" in said
    assert tree(source) == before


def test_pip_shows_the_report_of_a_rejected_interface(source, tmp_path):
    (source / "msg" / "Drive.msg").write_text("flot32 speed\n")
    command = [*PIP, "--prefix", tmp_path / "prefix", source]
    status, said = ended(*command, cwd=tmp_path, environment=clean_environment())
    assert status != 0
    assert re.search(
        r"(?m)^ *error\[IDL201\]: unknown type `flot32`\n *--> msg/Drive.msg:1:1", said
    )
    assert "Traceback" not in said


@pytest.mark.ros  # colcon is installed with what needs ROS 2
def test_colcon_takes_the_folder_for_one_of_cmake(scaffolded, tmp_path):
    said = run(BIN / "colcon", "--log-base", tmp_path / "log", "list", cwd=scaffolded.parent)
    assert said.split("\t")[0] == "demo_msgs"
    assert said.split("\t")[2].strip() == "(ros.ament_cmake)"


def test_pip_installs_into_a_clean_environment(distributions, source, tmp_path):
    """What the interfaces refer to is a requirement of the build, from an index as any other."""
    base = write(
        tmp_path / "base_msgs",
        {
            "package.xml": MANIFEST.replace("demo_msgs", "base_msgs"),
            "pyproject.toml": BUILD,
            "msg/Base.msg": "int8 b\n",
        },
    )
    wheels = tmp_path / "wheels"
    run(*PIP[:3], "wheel", *PIP[4:], "--wheel-dir", wheels, base, cwd=tmp_path)
    (source / "pyproject.toml").write_text(
        BUILD.replace('"idlc"]', '"idlc", "base-msgs"]')
        + '[project]\nname = "demo-msgs"\ndynamic = ["version"]\ndependencies = ["base-msgs"]\n'
    )
    (source / "msg" / "Drive.msg").write_text("base_msgs/Base base\n")
    environment = Environment(tmp_path)
    pip = [environment.bin / "python", "-m", "pip", "--disable-pip-version-check"]
    links = ["--find-links", distributions, "--find-links", wheels]
    # its own requirements, numpy among them, are not needed for what is imported here
    run(*pip, "install", *links, "--no-deps", "base-msgs", source, cwd=tmp_path)
    code = "from demo_msgs.msg import Drive; print(Drive())"
    said = run(environment.bin / "python", "-c", code, cwd=tmp_path)
    assert said == "demo_msgs.msg.Drive(base=base_msgs.msg.Base(b=0))\n"
    prefix = environment.folder / "venv"
    assert (prefix / "lib/libdemo_msgs__rosidl_typesupport_cpp.so").is_file()
    assert (prefix / "share/ament_index/resource_index/packages/demo_msgs").is_file()
    run(*pip, "uninstall", "--yes", "demo-msgs", cwd=tmp_path)
    assert not [path for path in prefix.rglob("*demo_msgs*") if path.is_file()]


def test_a_library_that_comes_with_types_is_installed_with_and_without_ros(tmp_path):
    folder = write(
        tmp_path / "trackkit",
        {
            "pyproject.toml": '[build-system]\nrequires = ["hatchling"]\n'
            'build-backend = "hatchling.build"\n[project]\nname = "trackkit"\nversion = "1"\n'
            '[tool.idlc]\npaths = ["interfaces"]\npackage = "track_msgs"\n'
            'out = "src/trackkit/ros"\nvendor-deps = true\n',
            "interfaces/msg/Track.msg": "std_msgs/Header header\ngeometry_msgs/Point[] points\n",
            "src/trackkit/__init__.py": "",
        },
    )
    run(sys.executable, "-m", "idlc", "gen", cwd=folder)
    prefix = tmp_path / "prefix"
    run(*PIP, "--prefix", prefix, folder, cwd=tmp_path)
    code = f"import sys; sys.path.insert(0, {str(site(prefix))!r})\n"
    code += """
from trackkit.ros.msg import Track
from trackkit.ros.vendor.std_msgs.msg import Header
track = Track(header=Header(frame_id="map"))
assert Track.deserialize(track.serialize()) == track
print(Header.__module__)
"""
    said = run(sys.executable, "-c", code, cwd=tmp_path)
    assert said == "std_msgs.msg._header\n"
    said = run(sys.executable, "-I", "-S", "-c", code, cwd=tmp_path)
    assert said == "trackkit.ros.vendor.std_msgs.msg._header\n"
