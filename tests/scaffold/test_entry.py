"""What entering a node makes of the texts of a package's files."""

from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.packaging.files import Edited, Refused
from idlc.scaffold import new_node, spec
from idlc.scaffold.roles import ROLES
from idlc.scaffold.spec import NodePlan, plan
from tests.support.files import write_all

SETUP = """\
from setuptools import setup

setup(
    name='demo',
    data_files=[('share/demo', ['package.xml'])],
    entry_points={'console_scripts': []},
)
"""
TEXTS = {"package.xml": '<package format="3"><name>demo</name></package>', "setup.py": SETUP}
(TIMER,) = (role for role in ROLES if role.name == "timer")


def heart(*, lifecycle: bool = False) -> NodePlan:
    endpoints = (spec.endpoint(TIMER, "1"),)
    return plan(spec.NodeSpec("heart", "demo", endpoints, lifecycle=lifecycle), [None], {})


def entered(texts, **options) -> new_node.NodeEntry:
    return new_node.node_entry(heart(**options), texts)


def test_a_package_gets_what_its_nodes_share_once():
    entry = entered(TEXTS)
    assert set(entry.added) == {
        "demo/__init__.py",
        "launch/demo_launch.py",
        "test/conftest.py",
    }
    again = entered({**TEXTS, **entry.added})
    assert again.added == {}
    assert set(again.edits) == {"setup.py", "package.xml", "launch/demo_launch.py"}


def test_a_new_launch_file_is_installed_and_lists_the_node():
    entry = entered(TEXTS, lifecycle=True)
    setup = entry.edits["setup.py"]
    assert isinstance(setup, Edited)
    assert "'heart = demo.heart:main'" in setup.text
    assert "('share/demo/launch', ['launch/demo_launch.py'])" in setup.text
    assert "LifecycleNode(" in entry.added["launch/demo_launch.py"]
    manifest = entry.edits["package.xml"]
    assert isinstance(manifest, Edited)
    assert "<exec_depend>launch</exec_depend>" in manifest.text
    assert "<exec_depend>launch_ros</exec_depend>" in manifest.text


def test_what_cannot_be_edited_is_refused_but_for_the_launch_file():
    launch = "x = LaunchDescription(nodes())\n"
    texts = {**TEXTS, "setup.py": "def f(:", "launch/some.launch.py": launch}
    entry = entered(texts)
    assert isinstance(entry.edits["setup.py"], Refused)
    ((path, note),) = entry.notes
    assert path == "launch/some.launch.py"
    assert "Node(package='demo', executable='heart', output='screen')" in note


def test_an_empty_launch_file_stays_as_the_user_left_it():
    entry = entered({**TEXTS, "launch/demo_launch.py": ""})
    assert "launch/demo_launch.py" not in {**entry.added, **entry.edits}
    ((path, note),) = entry.notes
    assert path == "launch/demo_launch.py"
    assert "is not edited" in note


def test_a_file_that_is_there_stays():
    texts = {**TEXTS, "test/conftest.py": "# mine\n"}
    assert "test/conftest.py" not in entered(texts).added


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ([], "launch/demo_launch.py"),
        (["demo.launch.py", "other.launch.py"], "launch/demo.launch.py"),
        (["demo.launch.py", "demo_launch.py"], "launch/demo_launch.py"),
        (["other.launch.py", "notes.md"], "launch/other.launch.py"),
        (["one.launch.py", "two.launch.py"], "launch/demo_launch.py"),
    ],
)
def test_the_launch_file_of_the_package_is_chosen(names, expected):
    assert expected in new_node.paths("demo", names)


#: The `packages` of a setup.py whose own ones are elsewhere, and what they become; or a note.
PACKAGES = {
    "['helm']": "['helm', 'demo']",
    "('helm',)": "('helm',)",
    "find_packages(include=['helm'])": "find_packages(include=['helm']) + ['demo']",
    "find_packages(exclude=['demo*'])": "find_packages(exclude=['demo*']) + ['demo']",
    "find_packages()": "find_packages()",
    "computed()": "computed()",
}


@pytest.mark.parametrize("packages", PACKAGES)
def test_a_new_python_package_is_installed_or_named(packages):
    setup = SETUP.replace("    name='demo',", f"    name='demo',\n    packages={packages},")
    entry = entered({**TEXTS, "setup.py": setup})
    after = entry.edits["setup.py"]
    assert isinstance(after, Edited)
    assert f"packages={PACKAGES[packages]},\n" in after.text
    notes = [note for path, note in entry.notes if path == "setup.py"]
    assert len(notes) == (packages in ("('helm',)", "computed()"))
    again = entered({**TEXTS, "setup.py": after.text, "demo/__init__.py": ""})
    assert again.edits["setup.py"] == after


def manifest(build_type):
    export = f"<export><build_type>{build_type}</build_type></export>" if build_type else ""
    return f'<package format="3">\n  <name>demo</name>\n  {export}\n</package>\n'


#: A package, and where its node is entered, or what is said instead.
BUILDS = {
    "ament_cmake": ({"package.xml": manifest("ament_cmake"), "CMakeLists.txt": ""}, "CMake builds"),
    "with a setup.py": (
        {"package.xml": manifest("ament_cmake"), "CMakeLists.txt": "", "setup.py": SETUP},
        "CMake builds",
    ),
    "no type": ({"package.xml": manifest(""), "CMakeLists.txt": ""}, "CMake builds"),
    "poetry": (
        {
            "package.xml": manifest("ament_python"),
            "pyproject.toml": '[tool.poetry]\nname = "demo"\n',
        },
        "pyproject.toml:[tool.poetry.scripts]\nheart = ",
    ),
    "hatchling": (
        {"package.xml": manifest("ament_python"), "pyproject.toml": '[project]\nname = "demo"\n'},
        "pyproject.toml:[project.scripts]\nheart = ",
    ),
    "src": (
        {
            "package.xml": manifest("ament_python"),
            "setup.py": SETUP.replace(
                "    name=", "    packages=['demo'], package_dir={'': 'src'},\n    name="
            ),
        },
        "src/demo/heart.py:def main(",
    ),
}


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("build", BUILDS)
def test_a_node_is_entered_where_its_build_looks_or_refused(build, capsys):
    files, expected = BUILDS[build]
    write_all(files)
    status = main(["scaffold", "node", "heart", "--timer", "1"])
    said = "".join(capsys.readouterr())
    path, _, text = expected.partition(":")
    assert (status == 0) == bool(text), said
    assert text in Path(path).read_text() if text else expected in said
    assert bool(text) or not Path("demo").exists()
