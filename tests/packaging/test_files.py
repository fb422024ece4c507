"""package.xml, launch files, setup.cfg and pyproject.toml are edited, and nothing else in them."""

import difflib

import pytest
from catkin_pkg.package import parse_package_string

from idlc.packaging import dependencies, entry_points, launch_py
from idlc.packaging.entry_points import ConsoleScript, add_console_script
from idlc.packaging.files import Edited, Outcome, Refused
from idlc.scaffold import interface

TALKING = launch_py.Started("demo", "talker")
TALKER = ConsoleScript("talker", "demo.talker:main")


def text_of(outcome: Outcome) -> str:
    assert isinstance(outcome, Edited), outcome
    return outcome.text


def added(before: str, after: str) -> list[str]:
    """Return the lines that were added; none may be gone."""
    lines = list(difflib.ndiff(before.splitlines(True), after.splitlines(True)))
    assert [line for line in lines if line.startswith("- ")] == []
    return [line[2:] for line in lines if line.startswith("+ ")]


MANIFEST = """\
<?xml version='1.0'  encoding="utf-8"?>
<!-- the package -->
<package   format="3">
    <name>demo</name>
    <version>0.0.1</version>
    <description>Says &quot;hello&quot; &amp; <b>more</b>.</description>
    <maintainer email='a@example.com'>A</maintainer>
    <license>MIT</license>

    <depend>rclpy</depend> <!-- of course -->
    <!-- <depend>std_msgs</depend> -->
    <exec_depend>std_srvs</exec_depend>

    <export><build_type>ament_python</build_type></export>
</package>
"""


def test_dependencies_are_added_where_they_are_missing():
    outcome = dependencies.add_dependencies(
        MANIFEST, depends=["rclpy", "std_msgs", "std_srvs", "demo"], tests=["t"], group=True
    )
    after = text_of(outcome)
    assert added(MANIFEST, after) == [
        "    <depend>std_msgs</depend>\n",
        "    <test_depend>t</test_depend>\n",
        "    <member_of_group>rosidl_interface_packages</member_of_group>\n",
    ]
    package = parse_package_string(after)
    assert {d.name for d in package.exec_depends} >= {"rclpy", "std_msgs", "std_srvs"}
    again = dependencies.add_dependencies(
        after, depends=["rclpy", "std_msgs", "std_srvs"], tests=["t"], group=True
    )
    assert again == outcome


def test_line_ends_and_short_manifests():
    crlf = MANIFEST.replace("\n", "\r\n")
    after = text_of(dependencies.add_dependencies(crlf, depends=["x"]))
    assert after.count("\r\n") == after.count("\n") == crlf.count("\n") + 1
    short = '<package format="3"><name>demo</name></package>'
    after = text_of(dependencies.add_dependencies(short, depends=["x"], group=True))
    assert "<depend>x</depend>" in after
    assert dependencies.add_dependencies(after, depends=["x"], group=True) == Edited(after)


def test_older_formats():
    old = MANIFEST.replace(' format="3"', "").replace("<depend>", "<run_depend>")
    old = old.replace("</depend>", "</run_depend>")
    after = text_of(dependencies.add_dependencies(old, depends=["rclpy", "x"], group=True))
    assert added(old, after) == ["    <run_depend>x</run_depend>\n"]


@pytest.mark.parametrize("text", ["", "<package>", "<robot><name>x</name></robot>"])
def test_what_is_no_manifest_is_refused(text):
    assert isinstance(dependencies.add_dependencies(text, depends=["x"]), Refused)


LAUNCH = '''\
from launch import LaunchDescription
from launch_ros.actions import Node  # nodes


def generate_launch_description():
    """Return all."""
    return LaunchDescription([
        Node(
            package="demo",  # ours
            executable="listener",
        ),
        # the end
    ])
'''


def test_a_node_is_added_to_a_launch_file():
    outcome = launch_py.add_node(LAUNCH, TALKING)
    after = text_of(outcome)
    new = '        Node(package="demo", executable="talker", output="screen"),\n'
    assert added(LAUNCH, after) == [new]
    assert launch_py.add_node(after, TALKING) == outcome
    assert launch_py.add_node(after, launch_py.Started("demo", "listener")) == outcome


@pytest.mark.parametrize(
    ("head", "called"),
    [
        ("import launch_ros.actions\n", "launch_ros.actions.Node("),
        ("from launch_ros.actions import Node as N\n", "N("),
        ("import os\n", "Node("),
    ],
)
def test_node_is_called_as_it_is_imported(head, called):
    text = f"{head}from launch import LaunchDescription\nx = LaunchDescription([])\n"
    after = text_of(launch_py.add_node(text, TALKING))
    assert f"LaunchDescription([{called}package=" in after
    names = {}
    stand_ins = after.replace("import launch_ros.actions", "launch_ros = Stub")
    for line in after.splitlines():
        if line.startswith("from launch"):
            stand_ins = stand_ins.replace(line, "")
    assert compile(stand_ins, "x", "exec"), names
    assert ("from launch_ros.actions import Node\n" in after) == (head == "import os\n")


@pytest.mark.parametrize(
    "text",
    [
        "from launch import LaunchDescription\nx = LaunchDescription(nodes())\n",
        "from launch import LaunchDescription\nx = LaunchDescription()\nx.add_action(y)\n",
        "def f():\n    x = LaunchDescription()\n    g(x)\n",
        "def f():\n    if a:\n        x = LaunchDescription()\n    return x\n",
        "from other import Node\nfrom launch import LaunchDescription\nx = LaunchDescription([])\n",
        "def f(:",
    ],
)
def test_unusual_launch_files_are_refused_with_the_line(text):
    outcome = launch_py.add_node(text, TALKING)
    assert isinstance(outcome, Refused)
    assert "executable='talker'" in outcome.line


CFG = """\
[metadata]
name = demo

[options.entry_points]
console_scripts =
    # ours
    listener = demo.listener:main

other =
    x = y:z

[develop]
script_dir=$base/lib/demo
"""
PYPROJECT = """\
[project]
name = "demo"  # ours
version = "1"

[project.scripts] # commands
listener = "demo.listener:main"

[tool.x]
"""
SETUP = "from setuptools import setup\nsetup(entry_points={'console_scripts': []})\n"


@pytest.mark.parametrize(
    ("files", "path", "new"),
    [
        ({"setup.py": SETUP, "setup.cfg": CFG}, "setup.cfg", "    talker = demo.talker:main\n"),
        (
            {"setup.py": "from setuptools import setup\nsetup()\n", "pyproject.toml": PYPROJECT},
            "pyproject.toml",
            'talker = "demo.talker:main"\n',
        ),
        ({"setup.cfg": CFG}, "setup.cfg", "    talker = demo.talker:main\n"),
        (
            {"setup.cfg": "[options.entry_points]\nconsole_scripts = a = b:c\n"},
            "setup.cfg",
            "    talker = demo.talker:main\n",
        ),
    ],
)
def test_scripts_outside_of_setup_py(files, path, new):
    where, outcome = add_console_script(files, TALKER)
    assert where == path
    after = text_of(outcome)
    assert added(files[path], after) == [new]
    assert add_console_script({**files, path: after}, TALKER) == (path, outcome)


def test_a_table_of_scripts_is_made_where_there_is_none():
    text = '[project]\nname = "demo"\nversion = "1"'
    _, outcome = add_console_script({"pyproject.toml": text}, TALKER)
    assert text_of(outcome).endswith('\n\n[project.scripts]\ntalker = "demo.talker:main"\n')


def test_setup_py_counts_where_the_project_leaves_scripts_to_it():
    text = '[project]\nname = "demo"\nversion = "1"\ndynamic = ["scripts"]\n'
    assert add_console_script({"pyproject.toml": text, "setup.py": SETUP}, TALKER)[0] == "setup.py"
    tools = "[tool.idlc]\nout = 'demo'\n"
    assert add_console_script({"pyproject.toml": tools, "setup.py": SETUP}, TALKER)[0] == "setup.py"


@pytest.mark.parametrize(
    ("files", "path"),
    [
        ({}, "setup.py"),
        ({"pyproject.toml": "[project"}, "pyproject.toml"),
        ({"pyproject.toml": '[project]\nname="a"\nscripts = {a = "b:c"}\n'}, "pyproject.toml"),
        ({"pyproject.toml": '[project]\nname="a"\nscripts.talker = "b:c"\n'}, "pyproject.toml"),
        ({"setup.cfg": CFG.replace("listener =", "talker =")}, "setup.cfg"),
        ({"setup.cfg": "name = demo\n" + CFG}, "setup.cfg"),
        # setuptools would read the second of the two keys alone
        ({"setup.cfg": CFG.replace("console_scripts", "Console_Scripts")}, "setup.cfg"),
    ],
)
def test_what_is_refused_outside_of_setup_py(files, path):
    where, outcome = add_console_script(files, TALKER)
    assert where == path
    assert isinstance(outcome, Refused)
    assert "demo.talker:main" in outcome.line


LAUNCH_FILE = "launch/demo_launch.py"
#: What installs data files, and whether the launch file is among them; `None` if nobody can see.
DATA_FILES = {
    "[('share/demo', ['package.xml'])]": False,
    "[('share/demo/launch', glob('launch/*.launch.py'))]": False,
    "[('share/demo/launch', ['launch/other_launch.py'])]": False,
    "[('share/demo', ['package.xml'])], tests_require=['launch-pytest']": False,
    "[('share/demo/launch', glob('launch/*'))]": True,
    "[('share/demo/launch', sorted(glob('./launch/*launch.py')))]": True,
    "[('share/demo/launch', files())]": True,
    "files()": None,
    "[*files('launch')]": None,
}


@pytest.mark.parametrize("data_files", DATA_FILES)
def test_a_launch_file_is_installed(data_files):
    is_installed = DATA_FILES[data_files]
    text = SETUP.replace("setup(", f"setup(data_files={data_files}, ")
    after, line = entry_points.add_launch(text, "demo", LAUNCH_FILE)
    element = f"('share/demo/launch', ['{LAUNCH_FILE}'])"
    assert (after == text) == (is_installed is not False)
    assert line == (element if is_installed is None else "")
    assert (element in after) == (is_installed is False)
    assert entry_points.add_launch(after, "demo", LAUNCH_FILE) == (after, line)
    assert entry_points.add_launch(SETUP, "demo", LAUNCH_FILE) == (SETUP, element)


CLASSIC = """\
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    ld = LaunchDescription()
    listener = Node(package="demo", executable="listener")
    ld.add_action(listener)  # ours

    # the end
    return ld
"""


def test_a_node_is_added_where_nodes_are_added_one_by_one():
    outcome = launch_py.add_node(CLASSIC, TALKING)
    after = text_of(outcome)
    new = '    ld.add_action(Node(package="demo", executable="talker", output="screen"))\n'
    assert added(CLASSIC, after) == [new]
    assert launch_py.add_node(after, TALKING) == outcome
    managed = launch_py.Started("demo", "keeper", lifecycle=True)
    after = text_of(launch_py.add_node(after, managed))
    assert "from launch_ros.actions import LifecycleNode, Node\n" in after
    assert '        name="keeper",\n' in after
    assert compile(after, "x", "exec")
    assert launch_py.add_node(after, managed) == Edited(after)


@pytest.mark.parametrize(
    ("text", "new"),
    [
        ("set(dependencies\n)\n", "set(dependencies\n  nav_msgs\n  std_msgs\n)\n"),
        ("set(dependencies\n  nav_msgs\n)\n", "set(dependencies\n  nav_msgs\n  std_msgs\n)\n"),
        (
            "set(dependencies\r\n  a\r\n)",
            "set(dependencies\r\n  a\r\n  nav_msgs\r\n  std_msgs\r\n)",
        ),
        ("set(dependencies)", "set(dependencies nav_msgs std_msgs)"),
        ("SET(dependencies a) # nav_msgs\n", "SET(dependencies a nav_msgs std_msgs) # nav_msgs\n"),
        ("find_package(nav_msgs)\nf(std_msgs)\n", None),
    ],
)
def test_dependencies_are_added_to_cmake(text, new):
    outcome = interface.add_cmake_dependencies(text, ["nav_msgs", "std_msgs"])
    assert outcome == Edited(new or text)
    assert interface.add_cmake_dependencies(new or text, ["nav_msgs", "std_msgs"]) == outcome


@pytest.mark.parametrize("text", ["", "set(others a)", "set(dependencies)\nset(dependencies)"])
def test_dependencies_for_unusual_cmake_are_refused(text):
    assert isinstance(interface.add_cmake_dependencies(text, ["nav_msgs"]), Refused)
