"""Workspaces of every shape: all commands see the same packages, names and files in them."""

import contextlib
import io
import json
import random
import subprocess
import sys
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.project.find import exclusion
from tests.support.files import write

COMMANDS = ("check", "show", "gen", "docs", "breaking", "fmt")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("idlc.project.prefixes.ament_prefixes", lambda: ())
    (tmp_path / ".git").mkdir()
    return tmp_path


def manifest(folder, name):
    write(f"{folder}/package.xml", f"<package><name>{name}</name></package>")


def idlc(*words):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main(list(words))
    said = out.getvalue() + err.getvalue()
    assert status in (0, 1, 2), said
    assert "IDL901" not in said
    assert "Traceback" not in said
    return status, out.getvalue(), err.getvalue()


def hashes(*words):
    lines = idlc("show", *words, "--format", "hash")[1].splitlines()
    return {name: value for value, name in (line.split() for line in lines)}


def generated(out):
    """The type hashes that the locks below a folder have recorded."""
    found = {}
    for path in Path(out).rglob("idlc.lock"):
        found.update(json.loads(path.read_text(encoding="utf-8"))["types"])
    return found


def random_workspace(seed):
    """Write packages that use earlier ones; return whether something is wrong with them."""
    rng = random.Random(seed)
    wrong = False
    known = ["std_msgs/Header", "int8", "string<=3"]
    for number in range(rng.randrange(1, 5)):
        name = f"pkg{number}"
        declared = not number or rng.random() < 0.6  # a single one would be called like OUT
        folder = f"ws/{rng.choice(['', 'group/', 'group/deep/'])}{name}"
        if declared:
            manifest(folder if rng.random() < 0.7 else (folder := f"{folder}_src"), name)
        for index in range(rng.randrange(3) if number else 2):
            kind = rng.choice(["msg", "msg", "srv", "action"])
            parts = {"msg": 1, "srv": 2, "action": 3}[kind]
            lines = [f"{rng.choice(known)} f{n}" for n in range(rng.randrange(3))]
            text = "\n---\n".join(["\n".join(lines)] * parts) + "\n"
            if rng.random() < 0.1:
                text, wrong = "missing_msgs/Nope x\n", True
                known.append(f"{name}/T{index}") if kind == "msg" else None
            elif kind == "msg":
                known.append(f"{name}/T{index}")
            write(f"{folder}/{kind}/T{index}.{kind}", text)
        if rng.random() < 0.2:
            write(f"{folder}/msg/left_out/Old.msg", "Header h\n")
    return wrong


@pytest.mark.parametrize("seed", range(30))
def test_all_commands_agree(seed):
    wrong = random_workspace(seed)
    write("pyproject.toml", "[tool.idlc]\nexclude = ['left_out']\n")
    status, *_ = idlc("check", "ws")
    assert status == int(wrong)
    assert idlc("breaking", "ws", "--against", "ws")[0] == status
    known = hashes("ws")
    assert idlc("gen", "ws", "-o", "out")[0] == status
    assert wrong or generated("out") == known
    assert wrong or idlc("gen", "ws", "-o", "out", "--check")[0] == 0
    assert wrong or hashes("ws") == known  # with what was generated beside
    assert idlc("docs", "ws", "-o", "site")[0] == status
    own = {name for name in known if "_" not in name.split("/")[2]}
    index = Path("site/index.js").read_text(encoding="utf-8") if own else ""
    assert all(name in index for name in own)
    assert not any("Old" in path.name for path in Path("out").rglob("*.py"))


def test_the_name_of_what_was_generated_is_known_to_all_commands():
    write("src/robo/interfaces/msg/P.msg", "int8 a\n")
    assert (
        "note: without a package.xml, the package name is `interfaces`"
        in idlc("show", "src/robo/interfaces", "--format", "hash")[2]
    )
    for out, told in (("src/robo/ifaces", False), ("elsewhere", False), ("far/away/pkg", True)):
        status, _, said = idlc("gen", "src/robo/interfaces", "-o", out)
        assert status == 0
        assert (f"--package {Path(out).name}" in said) == told
    assert set(hashes("src/robo/interfaces")) == {"interfaces/msg/P"}  # which of them?
    for path in Path("elsewhere").rglob("*"):
        path.unlink() if path.is_file() else None
    assert hashes("src/robo/interfaces") == generated("src/robo")
    assert hashes("src/robo/interfaces/msg/P.msg") == generated("src/robo")
    assert "note" not in idlc("show", "src/robo/interfaces", "--format", "hash")[2]
    assert idlc("show", "src/robo/interfaces")[1].startswith("# ifaces/msg/P\n")
    write("src/robo/interfaces/msg/P.msg", "int16 a\n")  # of other content
    assert set(hashes("src/robo/interfaces")) == {"interfaces/msg/P"}


def test_settings_name_a_package():
    write("interfaces/msg/P.msg", "int8 a\n")
    write("pyproject.toml", "[tool.idlc]\npaths = ['interfaces']\nout = 'lib/robo'\n")
    assert set(hashes("interfaces")) == {"robo/msg/P"}
    assert idlc("gen")[0] == 0
    assert generated("lib/robo") == hashes("interfaces")
    write("interfaces/more/msg/Q.msg", "int8 a\n")
    manifest("interfaces/more", "more")
    assert set(hashes("interfaces")) == {"interfaces/msg/P", "more/msg/Q"}


def test_a_tree_goes_on_where_it_was():
    manifest("src/a", "a")
    manifest("src/b", "b")
    write("src/a/msg/A.msg", "int8 a\n")
    write("src/b/msg/B.msg", "a/A a\n")
    assert idlc("gen", "src", "-o", "out/")[0] == 0
    assert sorted(path.name for path in Path("out").iterdir()) == ["a", "b"]
    Path("src/b/msg/B.msg").unlink()
    assert "out/a: 22 files from 1 interface (unchanged)" in idlc("gen", "src", "-o", "out")[1]
    assert idlc("gen", "src/a", "-o", "other")[0] == 0
    write("src/b/msg/B.msg", "a/A a\n")
    assert idlc("gen", "src", "-o", "other")[0] == 2  # it holds one package


def test_generated_trees_and_names_can_be_used_together(monkeypatch):
    manifest("src/tree_a", "tree_a")
    write("src/tree_a/msg/A.msg", "std_msgs/Header header\nint8 a\n")
    manifest("src/tree_b", "tree_b")
    write("src/tree_b/srv/B.srv", "tree_a/A a\n---\n")
    words = ("gen", "src", "std_srvs", "-o", "lib", "--vendor-deps")
    assert idlc(*words)[0] == 0
    assert idlc(*words, "--check")[0] == 0
    assert "unchanged" in idlc(*words)[1]
    script = "from tree_b.srv import B; from std_srvs.srv import Trigger; r = B.Request()"
    script += "; assert B.Request.deserialize(r.serialize()) == r; Trigger.Response().serialize()"
    monkeypatch.chdir("lib")
    subprocess.run([sys.executable, "-c", script], check=True)


def test_of_a_package_in_part_there_is_what_the_others_need(monkeypatch):
    words = ("gen", "nav_msgs/msg/Path", "geometry_msgs/Point", "std_msgs", "-o", "lib")
    assert idlc(*words)[0] == 0
    assert idlc(*words, "--check")[0] == 0
    assert not Path("lib/geometry_msgs/msg/_twist.py").exists()
    assert idlc("gen", "builtin_interfaces", "-o", "lib/builtin_interfaces")[0] == 0
    monkeypatch.chdir("lib")
    script = "from nav_msgs.msg import Path; Path.deserialize(Path().serialize())"
    subprocess.run([sys.executable, "-c", script], check=True)


def test_a_dependency_is_noticed_whose_file_is_called_like_an_own_one():
    manifest("src/a", "a")
    manifest("src/b", "b")
    write("src/a/msg/Same.msg", "int8 a\n")
    write("src/b/msg/Same.msg", "a/Same a\n")
    assert idlc("gen", "src/b", "-o", "b", "-I", "src")[0] == 0
    write("src/a/msg/Same.msg", "int16 a\n")
    assert idlc("gen", "src/b", "-o", "b", "-I", "src", "--check")[0] == 1
    assert "unchanged" not in idlc("gen", "src/b", "-o", "b", "-I", "src")[1]


@pytest.mark.parametrize("name", ["array", "typing", "numpy", "struct", "json", "abc", "this"])
def test_modules_that_programs_import_are_not_generated(name):
    write("demo/msg/A.msg", "int8 a\n")
    status, _, said = idlc("gen", "demo", "-o", f"out/{name}")
    assert status == 2
    assert "error[IDL607]" in said
    assert idlc("check", "demo", "--package", name)[0] == 0


@pytest.mark.parametrize("command", COMMANDS)
def test_excluded_files_are_not_even_read(command):
    manifest("p", "p")
    write("p/msg/A.msg", "int8 a\n")
    write("p/msg/ros1/A.msg", "Header h\n")
    more = {"gen": ["-o", "out/p"], "docs": ["-o", "site"], "breaking": ["--against", "p"]}
    words = [command, "p", *more.get(command, [])]
    assert idlc(*words)[0] != 0 or command == "fmt"
    assert idlc(*words, "--exclude", "msg/ros1/**")[0] == 0
    write("pyproject.toml", "[tool.idlc]\nexclude = ['ros1']\n")
    assert idlc(*words)[0] == 0
    assert idlc("check", "p/msg/ros1/A.msg")[0] == 0  # as a hook calls it
    assert "every interface file in `p/msg/ros1` is excluded" in "".join(
        map(str, idlc("check", "p/msg/ros1"))
    )


def test_what_is_excluded_cannot_be_used():
    manifest("p", "p")
    write("p/msg/A.msg", "B b\n")
    write("p/msg/B.msg", "int8 a\n")
    assert idlc("check", "p")[0] == 0
    assert idlc("check", "p/msg/A.msg")[0] == 0
    assert idlc("check", "p", "--exclude", "B.msg")[0] == 1
    assert idlc("gen", "p", "-o", "out", "--exclude", "B.msg")[0] == 1


@pytest.mark.parametrize(
    ("pattern", "path", "left_out"),
    [
        ("old", "old/msg/A.msg", True),
        ("old", "ws/old/msg/A.msg", True),
        ("old", "older/msg/A.msg", False),
        ("old/", "ws/old/msg/A.msg", True),
        ("./msg/ros1", "msg/ros1/A.msg", True),
        ("msg/ros1/**", "p/msg/ros1/deep/A.msg", True),
        ("msg/*.msg", "msg/A.msg", True),
        ("msg/*.msg", "msg/ros1/A.msg", False),
        ("**/ros1/*", "msg/ros1/A.msg", True),
        ("**", "msg/A.msg", True),
        ("a/**/A.msg", "a/A.msg", True),
        ("a/**/A.msg", "a/b/c/A.msg", True),
        ("a/**/A.msg", "b/A.msg", False),
        ("[AB].msg", "msg/B.msg", True),
        ("?.msg", "msg/BB.msg", False),
        ("", "msg/B.msg", False),
        ("/".join(["**", "a"] * 40), "/".join(["a"] * 79), True),
        ("/".join(["**", "a"] * 40), "/".join(["b"] * 79), False),
    ],
)
def test_a_pattern_leaves_out_what_it_fits_and_all_in_it(pattern, path, left_out, here):
    assert exclusion([pattern], here).has(here / path) is left_out
