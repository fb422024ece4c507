"""Edits of setup.py wrap the lines that they make too long, and change nothing else."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.packaging.setup_edits import arrange

FORMATTED = """\
import os

from setuptools import find_packages, setup

package_name = os.path.basename("demo")

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/demo"]),
        ("share/demo", ["package.xml"]),
    ],
    install_requires=["setuptools"],
)
"""
LONG = ", ".join(f"'name_{n} = demo.module_{n}:main'" for n in range(6))
LINES = {
    "a list": f"scripts = [{LONG}]\n",
    "a list in a call": f"setup(\n    name='demo',\n    scripts=[{LONG}],  # all\n)\n",
    "a whole call": f"setup(name='demo', entry_points={{'console_scripts': [{LONG}]}})\n",
    "a tuple": f"if True:\n\tx = ({LONG})\n",
    "a spread": f"setup(*[{LONG}], **{{'a': 1}}, y=lambda: 1, **{{**x, 'b': [{LONG}]}})\n",
    "parentheses": f"x = [('a' 'b'), (yes if no else {LONG!r}), ((1, 2)), {LONG}]\n",
    "carriage returns": f"x = [{LONG}]\r\ny = 1\r\n",
    "letters": f"x = ['ä€😀', {LONG}]; y = [{LONG}]\n",
    "a mark": f"\ufeffx = [{LONG}]\n",
}


@pytest.mark.parametrize("name", LINES)
def test_long_lists_are_wrapped(name):
    text = LINES[name]
    new = arrange("", text)
    bare = [one.removeprefix("\ufeff") for one in (text, new)]
    assert ast.dump(ast.parse(bare[0])) == ast.dump(ast.parse(bare[1]))
    assert new.count("#") == text.count("#")
    assert ("\r\n" in text) == ("\r\n" in new)
    assert new.replace("\r\n", "\n").count("\r") == 0
    if name != "parentheses":
        assert all(len(line) <= 99 for line in new.splitlines())
    assert arrange("", new) == new


@pytest.mark.parametrize(
    "text", [f"x = f(y for y in [{'1' * 99}])\n", f"x = '{'1' * 99}'\n", f"x = [{LONG}\n", "", "\f"]
)
def test_what_cannot_be_wrapped_stays(text):
    new = arrange("", text)
    assert new == text or ast.dump(ast.parse(new)) == ast.dump(ast.parse(text))


@pytest.mark.parametrize("depth", [500, 3000, 100_000])
def test_deep_code_stays_or_is_wrapped(depth):
    """Python compares as deep as its recursion limit allows, which libraries may have raised."""
    text = f"x = [{'1+' * depth}1]\n"
    new = arrange("", text)
    assert new in (text, f"x = [\n    {'1+' * depth}1,\n]\n")


@pytest.mark.parametrize("text", LINES.values())
def test_lines_of_the_user_stay(text):
    assert arrange(text, f"import os\n{text}") == f"import os\n{text}"


@pytest.mark.parametrize("command", ["check", "node"])
def test_commands_write_no_long_lines(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["scaffold", "package", "demo"]) == 0
    setup = tmp_path / "demo/setup.py"
    marker = "('share/ament_index/resource_index/packages', ['resource/demo'])"
    setup.write_text(
        f"from setuptools import setup\n\nsetup(\n    name='demo',\n    packages=['demo'],\n"
        f"    data_files=[{marker}],\n    entry_points={{'console_scripts': ["
        "'first = demo.first:main']},\n)\n"
    )
    monkeypatch.chdir("demo")
    if command == "check":
        (tmp_path / "demo/msg").mkdir()
        (tmp_path / "demo/msg/Drive.msg").write_text("bool a\n")
        main(["check", "--fix", "."])
        assert "share/demo/msg" in setup.read_text()
    else:
        name = "a_node_with_a_name_that_is_long"
        assert main(["scaffold", "node", name, "--publisher", "std_msgs/String:chatter"]) == 0
        assert name in setup.read_text()
    assert all(len(line) <= 99 for line in setup.read_text().splitlines())
    ast.parse(setup.read_text())


def test_a_formatted_file_stays_formatted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["scaffold", "package", "demo"]) == 0
    monkeypatch.chdir("demo")
    Path("setup.py").write_text(FORMATTED, encoding="utf-8")
    Path("msg").mkdir()
    Path("msg/Drive.msg").write_text("bool a\n", encoding="utf-8")
    main(["check", "--fix", "."])
    text = Path("setup.py").read_text(encoding="utf-8")
    assert "rosidl_interfaces" in text
    assert "find_spec" in text
    for words in (["check", "--select", "E,F,I"], ["format", "--check"]):
        command = [sys.executable, "-m", "ruff", *words, "--isolated", "setup.py"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{done.stdout}\n{text}"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("", "from glob import glob\nfrom runpy import run_path\n\n"),
        ("# words\n\n", "# words\n\nfrom glob import glob\nfrom runpy import run_path\n\n"),
        ("import os\n\n", "import os\nfrom glob import glob\nfrom runpy import run_path\n\n"),
        (
            "import abc\nfrom os import path\nimport sys\n\n",
            """import abc
from glob import glob
from os import path
from runpy import run_path
import sys

""",
        ),
        (
            "from __future__ import annotations\n\nimport sys\nfrom os import path\n\n",
            """from __future__ import annotations

import sys
from glob import glob
from os import path
from runpy import run_path

""",
        ),
    ],
)
def test_new_imports_stand_where_a_formatter_has_them(old, new):
    rest = "from setuptools import setup\n\nsetup()\n"
    added = "from runpy import run_path\nfrom glob import glob\n"
    assert arrange(old + rest, f"{old}{added}{rest}") == new + rest
    assert arrange(old + rest, old + rest) == old + rest
    mark = "\ufeff"
    assert arrange(mark + old + rest, f"{mark}{old}{added}{rest}") == mark + new + rest
