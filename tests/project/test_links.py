"""Links that lead out of a git repository, which everyone who can commit to it could add."""

from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.project.root import Root
from tests.support.files import write
from tests.support.repositories import git

PRIVATE = "int32 hunter2-is-no-name\n"
LIB = "<package><name>lib_msgs</name></package>\n"
#: Links in a repository `clone` and their targets, by command.
OUT = [
    ("check", "msg/Out.msg", "../../home/Secret.msg"),
    ("check", "msg/Out.msg", "{top}/home/Secret.msg"),
    ("check", "msg/Out.msg", "../inner"),  # another link
    ("check", "msg/Out.msg", "../.git/config"),
    ("check", "deps", "../home"),
    ("check", "msg/deep", "/"),
    ("fmt", "msg/Out.msg", "../../home/Secret.msg"),
    ("fmt", "deps", "../home"),
    ("gen", "deps", "../home"),
]


@pytest.fixture
def clone(here, monkeypatch):
    """A repository of one package, and files of the user around it."""
    write("home/Secret.msg", PRIVATE)
    write("home/lib_msgs/package.xml", LIB)
    write("home/lib_msgs/msg/Lib.msg", PRIVATE)
    write("clone/package.xml", LIB.replace("lib", "own"))
    write("clone/msg/A.msg", "int32 a\n")
    write("clone/inside/B.msg", "int32 b\n")
    Path("clone/inner").symlink_to("../home/Secret.msg")
    monkeypatch.chdir(here / "clone")
    git("init", "-q")
    return here / "clone"


@pytest.mark.parametrize(("command", "path", "target"), OUT)
def test_links_of_a_repository_do_not_lead_out_of_it(clone, capsys, command, path, target):
    Path(path).symlink_to(target.format(top=clone.parent))
    git("add", "-f", ".")
    words = ["-o", "out"] if command == "gen" else []
    status = main([command, ".", *words])
    printed = "".join(capsys.readouterr())
    assert "hunter2" not in printed
    assert "repositoryformatversion" not in printed
    assert "leads out of its git repository" in printed
    assert status == (1 if path.endswith(".msg") else 0)
    assert (clone.parent / "home/Secret.msg").read_text() == PRIVATE


def test_other_links_are_followed(clone, capsys):
    """Links of the user, links within the repository, and what the user names."""
    Path("msg/B.msg").symlink_to("../inside/B.msg")
    git("add", ".")
    Path("mine").symlink_to("../home")
    Path("msg/Mine.msg").symlink_to("../../home/Secret.msg")
    assert main(["check", "msg"]) == 1  # the user's file is read, and wrong
    assert "hunter2" in "".join(capsys.readouterr())
    git("add", ".")
    assert main(["check", "mine"]) == 1
    assert "lib_msgs/msg/Lib.msg" in "".join(capsys.readouterr())
    root = Root(Path.cwd())
    links = ("msg/B.msg", "msg/Mine.msg")
    assert [root.leads_out(link) for link in links] == [False, True]


def test_a_repository_that_git_cannot_read_has_no_trusted_links(clone):
    Path("msg/Out.msg").symlink_to("../../home/Secret.msg")
    Path(".git/index").write_bytes(b"DIRC damaged")
    assert Root(clone).leads_out("msg/Out.msg")
