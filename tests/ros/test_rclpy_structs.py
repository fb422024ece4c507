"""The introspection road, which middlewares like Cyclone DDS take: real C structures.

No wheel has such a middleware, so a test-only one reads and writes the memory: it walks over the
members as Cyclone DDS does. For types of the wheels, the C++ code that rosidl generated reads and
writes it, too.
"""

import json
import subprocess
import sys

import pytest
from installed import HERE, SHARE, generate, interfaces, interfaces_in, names_in

PACKAGES = ("diagnostic_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "std_srvs")
OURS = (HERE / "every_kind", HERE.parents[1] / "examples" / "my_robot_controller")


@pytest.fixture(scope="module")
def look(tmp_path_factory, ros_environment):
    """Run structs_side.py on names; fail with what it complains about."""
    classes = tmp_path_factory.mktemp("classes")
    for files in (*(SHARE / package for package in (*PACKAGES, "test_msgs")), *OURS):
        generate(files, classes / files.name)
    environment = {**ros_environment, "PYTHONPATH": f"{HERE}:{classes}"}

    def run(script, *words):
        done = subprocess.run(
            [sys.executable, str(HERE / script), *words],
            env=environment,
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

    def check(official, names):
        complaints = run("structs_side.py", str(shapes), official, *names)
        assert complaints == [f"looked at {len(names)}"]

    return check


def test_every_kind_of_field(look):
    found = interfaces_in(OURS)
    names = names_in(found, found)
    names.insert(0, "every_kind/msg/Others")
    look("alone", names)


def test_every_message_agrees_with_generated_code(look):
    look("official", names_in((*PACKAGES, "test_msgs"), interfaces()))
