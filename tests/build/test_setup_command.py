"""What setup(idlc_interfaces=True) installs and distributes, whatever `data_files` lists."""

import sys
import tarfile

import pytest

from tests.support import programs

pytestmark = pytest.mark.long

SETUP = """\
import os, platform, sys
from glob import glob
from setuptools import setup
package_name = 'demo'
platform.machine = lambda: {machine!r}
setup(
    idlc_interfaces=True,
    name=package_name,
    version='1.0',
    packages=['demo'],
    data_files={data_files},
)
"""
INDEX = "share/ament_index/resource_index"
MARKER = f"('{INDEX}/packages', ['resource/' + package_name])"
#: How people write it.
SHAPES = {
    "nothing": "None",
    "the marker alone": f"[{MARKER}]",
    "a tuple of lists": f"([*{MARKER}], ['share/demo/msg', ('msg/Drive.msg',)])",
    "all of it, and other descriptions": f"""[
        {MARKER},
        ('{INDEX}/rosidl_interfaces/', glob('resource/rosidl_interfaces/*')),
        (os.path.join('share', package_name), ['package.xml', 'README.md']),
        ('share//demo/./msg/', glob('msg/*.msg') + glob('resource/msg/*')),
    ]""",
    "a file for the prefix itself": f"[{MARKER}, 'README.md']",
}


@pytest.fixture
def package(tmp_path):
    """Return a package that was built by another idlc before an interface was added."""
    for path, text in {
        "package.xml": "<package format='3'><name>demo</name><version>1.0.0</version></package>\n",
        "README.md": "A demo.\n",
        "resource/demo": "",
        "resource/rosidl_interfaces/demo": "msg/Old.msg\n",
        "resource/msg/Drive.json": "{}\n",
        "demo/__init__.py": "",
        "msg/Drive.msg": "wstring note\n",
    }.items():
        (tmp_path / "demo" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "demo" / path).write_text(text)
    return tmp_path / "demo"


def set_up(package, shape, machine, *words):
    (package / "setup.py").write_text(SETUP.format(data_files=SHAPES[shape], machine=machine))
    command = [sys.executable, "setup.py", "-q", *words]
    return programs.run_with(*command, cwd=package, ROS_DISTRO="jazzy")


@pytest.mark.parametrize("machine", ["x86_64", "riscv64"])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_index_says_what_is_installed(shape, machine, package, tmp_path):
    before = {path for path in package.rglob("*") if path.is_file()}
    prefix = tmp_path / "prefix"
    said = set_up(package, shape, machine, "install_data", "--install-dir", str(prefix))
    found = {
        path.relative_to(prefix).as_posix(): path.read_text(errors="replace")
        for path in prefix.rglob("*")
        if path.is_file()
    }
    own = {path for path in found if "demo" in path} - {"share/demo/README.md"}
    expected = {f"share/demo/msg/Drive.{ending}" for ending in ("msg", "idl", "json")}
    expected |= {f"{INDEX}/package_run_dependencies/demo", "share/demo/package.xml"}
    if machine == "x86_64":
        expected |= {f"{INDEX}/{kind}/demo" for kind in ("packages", "rosidl_interfaces")}
        expected |= {
            f"lib/libdemo__rosidl_typesupport_{kind}cpp.so" for kind in ("", "introspection_")
        }
        listed = found[f"{INDEX}/rosidl_interfaces/demo"].split()
        assert listed == ["msg/Drive.idl", "msg/Drive.msg"]
    else:
        assert "idlc does not add `demo` to ROS 2's index" in said
    assert own == expected
    assert found["share/demo/msg/Drive.json"] != "{}\n"
    assert ("README.md" in found) == (shape == "a file for the prefix itself")
    after = {path for path in package.rglob("*") if path.is_file()}
    new = {path.relative_to(package).as_posix() for path in after - before}
    assert {path.partition("/")[0] for path in new} == {"build", "demo", "setup.py"}


@pytest.mark.parametrize("machine", ["x86_64", "riscv64"])
def test_a_source_distribution_holds_what_data_files_lists(machine, package, tmp_path):
    shape = "all of it, and other descriptions"
    set_up(package, shape, machine, "install_data", "--install-dir", str(tmp_path / "prefix"),
           "sdist", "--dist-dir", str(tmp_path / "dist"))  # fmt: skip
    (archive,) = (tmp_path / "dist").glob("*.tar.gz")
    with tarfile.open(archive) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    assert {"msg/Drive.msg", "resource/demo", "package.xml", "setup.py"} <= names
    assert not [name for name in names if name.startswith("build")]


KEYWORD_SETUP = """\
from setuptools import find_packages, setup

setup(
    name='demo',
    version='1.0',
    packages=find_packages(),
    data_files=[('share/ament_index/resource_index/packages', ['resource/demo'])],
    idlc_interfaces=True,
)
"""
BUILD = ("build", "install", "--single-version-externally-managed", "--record", "record.txt")


def built_by_keyword(python, package, prefix, **environment):
    """Build and install a package; return what that printed."""
    (package / "setup.py").write_text(KEYWORD_SETUP)
    places = (f"--prefix={prefix}", f"--install-lib={prefix}/site")
    return programs.run_with(python, "setup.py", *BUILD, *places, cwd=package, **environment)


def test_a_keyword_compiles_and_installs_classes_that_are_new(package, tmp_path):
    (package / "msg/Drive.msg").write_text("float32 speed\n")
    built_by_keyword(sys.executable, package, tmp_path / "prefix", ROS_DISTRO="jazzy")
    assert (tmp_path / "prefix/site/demo/msg/_drive.py").is_file()
    assert (tmp_path / "prefix/share/demo/msg/Drive.json").is_file()


def test_classes_of_removed_interfaces_are_not_built_again(package, tmp_path):
    (package / "srv").mkdir()
    (package / "srv/Ask.srv").write_text("---\n")
    prefix = tmp_path / "prefix"
    built_by_keyword(sys.executable, package, prefix, ROS_DISTRO="jazzy")
    assert (prefix / "site/demo/srv/_ask.py").is_file()
    (package / "srv/Ask.srv").unlink()
    (package / "msg/Drive.msg").rename(package / "msg/Go.msg")
    built_by_keyword(sys.executable, package, prefix, ROS_DISTRO="jazzy")
    assert not (prefix / "site/demo/srv").exists()
    modules = {path.name for path in (prefix / "site/demo/msg").glob("*.py")}
    assert modules == {"__init__.py", "_go.py", "_go__codec.py"}
    assert sorted(path.name for path in (prefix / "share/demo/msg").iterdir()) == [
        f"Go.{ending}" for ending in ("idl", "json", "msg")
    ]


def test_classes_of_interfaces_that_are_all_gone_are_not_installed(package, tmp_path):
    prefix = tmp_path / "prefix"
    built_by_keyword(sys.executable, package, prefix, ROS_DISTRO="jazzy")
    (package / "msg/Drive.msg").unlink()
    built_by_keyword(sys.executable, package, prefix, ROS_DISTRO="jazzy")  # as on a robot
    (package / ".git").mkdir()
    with pytest.raises(AssertionError, match=r"out of date: `msg/Drive\.msg` was removed"):
        built_by_keyword(sys.executable, package, prefix, ROS_DISTRO="jazzy")


def test_packages_need_not_name_what_a_package_comes_with(package, tmp_path):
    (package / "msg/Drive.msg").write_text("std_msgs/Header header\n")
    (package / "pyproject.toml").write_text("[tool.idlc]\nvendor-deps = true\n")
    set_up(package, "nothing", "x86_64", "build", "-b", str(tmp_path / "root"))
    assert len(list(tmp_path.glob("root/**/demo/_vendor/std_msgs/msg/_header.py"))) == 1
