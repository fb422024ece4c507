"""The introspection type support, which middlewares like Cyclone DDS take: real C structures.

No wheel has such a middleware, so a test-only one reads and writes the memory: it walks over the
members as Cyclone DDS does, from a thread that never gets Python's lock. For types of the wheels,
the C++ code that rosidl generated reads and writes it, too, and C code that rosidl generated makes
and frees it.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.ros.test_rclpy_abi import VERSIONS
from tests.support.installed import SHARE, generate, interfaces, interfaces_in, names_in
from tests.support.paths import EVERY_KIND, EXAMPLE, PROGRAMS
from tests.support.tools import tool

PACKAGES = ("diagnostic_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "std_srvs")
OURS = (EVERY_KIND, EXAMPLE)


def compiled(library: Path, source: str, *words: str) -> Path:
    """Return a library, made of C with the headers of the installed ROS 2."""
    prefix = Path(sys.prefix)
    command = [tool("gcc"), "-O1", "-Wall", "-Werror", "-shared", "-fPIC", *words]
    command += ["-o", library, PROGRAMS / source, f"-L{prefix / 'lib'}", "-lrosidl_runtime_c"]
    for package in ("rcutils", "rosidl_runtime_c", "rosidl_typesupport_interface"):
        command += [f"-I{prefix / 'include' / package}"]
    command += [f"-I{prefix / 'include' / 'rosidl_typesupport_introspection_c'}", "-lpthread"]
    subprocess.run([str(word) for word in command], check=True)
    return library


@pytest.fixture(scope="module")
def walker(tmp_path_factory) -> Path:
    """Return the middleware of walker.c, compiled."""
    return compiled(tmp_path_factory.mktemp("walker") / "walker.so", "walker.c")


@pytest.fixture(scope="module")
def look(tmp_path_factory, ros_environment, walker):
    """Run structs_side.py on names; fail with what it complains about."""
    classes = tmp_path_factory.mktemp("classes")
    for files in (*(SHARE / package for package in (*PACKAGES, "test_msgs")), *OURS):
        generate(files, classes / files.name)
    environment = {**ros_environment, "PYTHONPATH": f"{PROGRAMS}:{classes}", "WALKER": str(walker)}

    def run(script, *words, **more):
        done = subprocess.run(
            [sys.executable, str(PROGRAMS / script), *words],
            env={**environment, **more},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    every = names_in(interfaces(), interfaces())
    every += names_in(interfaces_in(OURS), interfaces_in(OURS))
    shapes = classes / "shapes.json"
    shapes.write_text(run("shapes.py", *every)[0], encoding="utf-8")
    assert json.loads(shapes.read_text("utf-8"))

    def check(official, names, **more):
        complaints = run("structs_side.py", str(shapes), official, *names, **more)
        assert complaints == [f"looked at {len(names)}"]

    return check


def test_every_kind_of_field(look):
    found = interfaces_in(OURS)
    names = names_in(found, found)
    names.insert(0, "every_kind/msg/Others")
    look("alone", names)


def test_every_message_agrees_with_generated_code(look):
    look("official", names_in((*PACKAGES, "test_msgs"), interfaces()))


@pytest.mark.parametrize(
    "version",
    ["humble", *(pytest.param(name, marks=pytest.mark.long) for name in ("lyrical", "rolling"))],
)
def test_every_message_in_the_structures_of_another_version(version, look, tmp_path):
    """Type support measures its tables, and walker.c walks over what it then makes."""
    words = [f"-D{one}" for one in VERSIONS[version]]
    soname = "-Wl,-soname,librcl_interfaces__rosidl_typesupport_introspection_c.so"
    tables = compiled(tmp_path / "tables.so", "abi.c", soname, *words)
    walker = compiled(tmp_path / "walker.so", "walker.c", "-DOTHER_VERSION", *words)
    names = ["every_kind/msg/Others", *names_in((*PACKAGES, "test_msgs"), interfaces())]
    names += names_in(interfaces_in(OURS), interfaces_in(OURS))
    look("alone", names, TABLES=str(tables), WALKER=str(walker))
