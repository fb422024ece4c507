"""`--against git:REF` in repositories of others, and with a git that cannot answer."""

import json
import os
import re
import shutil
import stat
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.project import git as revision
from tests.support.files import write
from tests.support.repositories import changed, git, instead, version


@pytest.fixture(autouse=True)
def alone(here, monkeypatch):
    """Nothing but the repository says what git does."""
    write("home/.gitconfig", "[uploadpack]\nallowFilter = true\n")
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(here / "home/.gitconfig"))
    monkeypatch.setenv("GIT_CONFIG_NOSYSTEM", "1")
    return here


def compare(capsys, *words):
    """Return the status of a comparison, the codes that were reported, and the summary."""
    status = main(["breaking", *words, "--format", "json"])
    *found, summary = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    return status, [one["code"] for one in found], summary


FAILED = (2, ["IDL630"])
BROKEN = (1, ["IDL507"])

#: Everything in a repository's settings that names a program or a place from which to fetch.
PROGRAMS = """\
[core]
    repositoryformatversion = 1
    worktree = {worktree}
    fsmonitor = touch {mark}
    hooksPath = {hooks}
    pager = touch {mark}
    editor = touch {mark}
    sshCommand = touch {mark}
    gitProxy = touch {mark}
    askPass = touch {mark}
    alternateRefsCommand = touch {mark}
[extensions]
    partialClone = origin
[remote "origin"]
    url = {url}
    promisor = true
    partialclonefilter = blob:none
    uploadpack = touch {mark}; git-upload-pack
[protocol]
    allow = always
[protocol "file"]
    allow = always
[protocol "ext"]
    allow = always
[pager]
    rev-parse = touch {mark}
    ls-tree = touch {mark}
    cat-file = touch {mark}
    ls-files = touch {mark}
    config = touch {mark}
[alias]
    rev-parse = !touch {mark}
    ls-tree = !touch {mark}
    cat-file = !touch {mark}
    ls-files = !touch {mark}
[diff "x"]
    textconv = touch {mark}
    command = touch {mark}
[filter "x"]
    smudge = touch {mark}
    process = touch {mark}
[credential]
    helper = !touch {mark}
"""
#: A git from before it knew these.
OLD_GIT = """
unset GIT_NO_LAZY_FETCH
while [ "$1" = -c ]; do shift 2; done
exec "$GIT" "$@"
"""
NO_SH = pytest.mark.skipif(os.name == "nt", reason="programs are found by their #! lines")


@pytest.fixture(params=["git", pytest.param("old git", marks=NO_SH)])
def some_git(request, monkeypatch, alone):
    if request.param == "old git":
        instead(monkeypatch, alone / "old git", OLD_GIT)


def programs(folder, url, worktree="."):
    """Have the settings of a git directory name programs; lack what would have to be fetched."""
    mark = Path("ran").absolute()
    hook = Path("hooks/post-index-change").absolute()
    write(hook, f"#!/bin/sh\ntouch {mark}\n")
    hook.chmod(0o755)
    text = PROGRAMS.format(mark=mark, url=url, hooks=hook.parent, worktree=worktree)
    (folder / "config").write_text(text, encoding="utf-8")
    blob = git("rev-parse", "HEAD~1:p/msg/A.msg", cwd="up").decode().strip()
    lacking = folder / "objects" / blob[:2] / blob[2:]
    lacking.chmod(stat.S_IWRITE | stat.S_IREAD)
    lacking.unlink()
    return mark


@pytest.mark.usefixtures("some_git")
@pytest.mark.parametrize("url", [".", "ext::touch ran", "ssh://x/y", "file:///"])
def test_the_settings_of_a_repository_run_nothing(alone, url, capsys):
    shutil.copytree(changed("up"), "victim")
    mark = programs(alone / "victim/.git", url, worktree=alone / "victim")
    assert compare(capsys, "victim/p", "--against", "git:HEAD~1")[:2] == FAILED
    assert revision.setting("user.name", Path.cwd()) == ""
    assert not mark.exists()


@pytest.mark.usefixtures("some_git")
@pytest.mark.parametrize("worktree", [".", ".."])
def test_a_tracked_folder_is_no_repository(alone, worktree, capsys):
    """A clone brings everything of a bare repository; it is files of the one around it."""
    shutil.copytree(changed("up") / ".git", "victim/p")
    shutil.copytree("up/p/msg", "victim/p/msg")
    mark = programs(alone / "victim/p", ".", worktree)
    git("init", "-q", cwd="victim")
    git("add", "-f", ".", cwd="victim")
    git("commit", "-qm", "first", cwd="victim")
    assert compare(capsys, "victim/p", "--against", "git:HEAD")[:2] == (0, [])
    write("victim/p/msg/Same.msg", "int64 same\n")
    assert compare(capsys, "victim/p", "--against", "git:HEAD")[:2] == BROKEN
    assert compare(capsys, "victim/p", "--against", "git:HEAD~1")[:2] == FAILED
    shutil.rmtree("victim/.git")
    assert compare(capsys, "victim/p", "--against", "git:HEAD")[:2] == FAILED
    assert not mark.exists()


def test_a_repository_whose_files_are_elsewhere(alone, capsys):
    folder = changed("r")
    shutil.copytree(folder / "p", "other/p")
    for place in (alone / "other", alone):
        git("config", "core.worktree", str(place), cwd=folder)
        assert compare(capsys, "r/p", "--against", "git:HEAD~1")[:2] == FAILED
    assert compare(capsys, "other/p", "--against", "git:HEAD~1")[:2] == FAILED


def test_a_folder_that_only_begins_like_a_repository(capsys):
    """Nor does the one around it count."""
    folder = changed("r")
    (folder / "p/.git").mkdir()
    assert compare(capsys, "r/p", "--against", "git:HEAD~1")[:2] == FAILED


@pytest.mark.parametrize("entry", ["", ".", "bin", "r/../bin"])
def test_a_program_in_the_working_folder_is_not_started(alone, monkeypatch, entry, capsys):
    changed("r")
    for place in ("git", "bin/git", "git.exe", "bin/git.exe"):
        write(place, f"#!/bin/sh\ntouch {alone / 'ran'}\n")
        Path(place).chmod(0o755)
    monkeypatch.setenv("PATH", f"{entry}{os.pathsep}{os.environ['PATH']}")
    assert compare(capsys, "r/p", "--against", "git:HEAD~1")[:2] == BROKEN
    monkeypatch.setenv("PATH", entry)
    assert compare(capsys, "r/p", "--against", "git:HEAD~1")[:2] == FAILED
    assert not (alone / "ran").exists()


def test_in_a_hook_of_git_the_path_says_which_repository_it_is(alone, monkeypatch, capsys):
    changed("r")
    changed("other")
    for name, value in (("DIR", "other/.git"), ("INDEX_FILE", "other/.git/index"), ("PREFIX", "p")):
        monkeypatch.setenv(f"GIT_{name}", str(alone / value))
    assert compare(capsys, "r/p", "--against", "git:HEAD~1")[:2] == BROKEN
    monkeypatch.chdir("r")
    assert compare(capsys, "p", "--against", "git:HEAD~1")[:2] == BROKEN


@pytest.mark.parametrize("name", ["HEAD\0", "HEAD\n", "\udc80", "-p", "--help", "HEAD:p", "HEAD~9"])
def test_names_that_mean_no_revision(name, capsys):
    changed("r")
    assert compare(capsys, "r/p", "--against", f"git:{name}")[:2] == FAILED


#: A git whose Nth answer is wrong in some way.
WRONG = """
read -r number <{folder}/count
echo $((number - 1)) >{folder}/count
[ "$number" = 0 ] || exec "$GIT" "$@"
"$GIT" "$@" >{folder}/answer
size=$(wc -c <{folder}/answer)
{way}
"""
WAYS = {
    "fails": "echo 'fatal: x' >&2; exit 128",
    "fails without a word": "exit 1",
    "fails at the end": "cat {folder}/answer; exit 128",
    "dies": "kill -9 $$",
    "half an answer": "head -c $((size / 2)) {folder}/answer",
    "all but the last bytes": "head -c $((size - 2)) {folder}/answer",
    "missing": f"printf '%s missing\\n' {' '.join(['0' * 40] * 9)}",
    "another": "tr 0-9a-f 1-9a-f0 <{folder}/answer",
}


@NO_SH
@pytest.mark.parametrize("way", WAYS)
def test_any_answer_that_git_owes_is_an_error(alone, monkeypatch, way, capsys):
    """Nothing that could not be asked for is taken for nothing."""
    changed("r")
    words = ("r/p", "--against", "git:HEAD~1")
    folder = alone / "bin"
    count = folder / "count"
    script = WRONG.format(folder=folder, way=WAYS[way].format(folder=folder))
    instead(monkeypatch, folder, script)
    count.write_text("99")
    assert compare(capsys, *words)[:2] == BROKEN
    calls = 99 - int(count.read_text())
    assert calls >= 4
    for number in range(calls):
        count.write_text(str(number))
        assert compare(capsys, *words)[:2] == FAILED, f"call {number}"


@NO_SH
def test_a_git_that_does_not_answer(monkeypatch, capsys):
    folder = changed("r")
    monkeypatch.setattr(revision, "PATIENCE", 0.5)
    os.mkfifo(folder / ".git/pipe")
    with (folder / ".git/config").open("a") as file:
        file.write("[include]\npath = pipe\n")
    assert compare(capsys, "r/p", "--against", "git:HEAD~1")[:2] == FAILED


def test_what_git_says_to_do_is_the_hint(monkeypatch, capsys):
    changed("r")
    monkeypatch.setenv("GIT_TEST_ASSUME_DIFFERENT_OWNER", "1")
    assert main(["breaking", "r/p", "--against", "git:HEAD~1"]) == 2
    assert "hint: `git config --global --add safe.directory " in capsys.readouterr().out


def test_the_hint_fits_what_is_wrong(capsys):
    folder = changed("r")
    for name, place, hints in (
        ("HEAD~9", "r/p", ["git branch --all", "git tag", "git fetch"]),
        ("-p", "r/p", ["git branch --all", "git tag", "git fetch"]),
        ("HEAD", ".", []),
    ):
        assert main(["breaking", place, "--against", f"git:{name}"]) == 2
        said = capsys.readouterr().out
        assert re.findall("`(git .*?)`", said) == hints
        for one in hints:
            git(*one.split()[1:], cwd=folder)
    blob = git("rev-parse", "HEAD:p/msg/A.msg", cwd=folder).decode().strip()
    lost = folder / ".git/objects" / blob[:2] / blob[2:]
    lost.chmod(stat.S_IWRITE | stat.S_IREAD)
    lost.write_bytes(b"")
    assert main(["breaking", "r/p", "--against", "git:HEAD"]) == 2
    said = capsys.readouterr().out
    assert re.findall("`(git fsck)`", said)
    assert "fetch" not in said


@NO_SH
def test_git_is_quoted_without_its_marks(alone, monkeypatch, capsys):
    changed("r")
    lines = "warning: x\\nerror: a is empty\nfatal: a is corrupt\nerror: a is empty\n"
    instead(monkeypatch, alone / "bin", f"printf '{lines}' >&2\nexit 1")
    assert main(["breaking", "r/p", "--against", "git:HEAD"]) == 2
    assert "cannot read `git:HEAD`: a is empty; a is corrupt\n" in capsys.readouterr().out


@pytest.mark.parametrize("every", ["blob:none", "tree:0", "depth"])
def test_what_a_clone_lacks_is_an_error_and_is_not_fetched(alone, every, capsys):
    changed("o")
    option = "--depth=1" if every == "depth" else f"--filter={every}"
    git("clone", "-q", option, (alone / "o").as_uri(), "c")
    before = sorted(Path("c/.git").rglob("*"))
    assert compare(capsys, "c/p", "--against", "git:HEAD~1")[:2] == FAILED
    assert sorted(Path("c/.git").rglob("*")) == before
    Path("o").rename("gone")
    assert compare(capsys, "c/p", "--against", "git:HEAD~1")[:2] == FAILED
    Path("gone").rename("o")
    assert main(["breaking", "c/p", "--against", "git:HEAD~1"]) == 2
    quoted = capsys.readouterr().out.split("`")
    (command,) = (one for one in quoted if one.startswith("git fetch"))
    if every != "depth" and version() < (2, 36):
        return  # which does not know the command
    git(*command.split()[1:], cwd="c")
    assert compare(capsys, "c/p", "--against", "git:HEAD~1")[:2] == BROKEN


@pytest.mark.long
def test_any_object_that_is_lost_or_damaged(capsys):
    folder = changed("r")
    expected = set()
    for path in sorted((folder / ".git/objects").glob("??/*")):
        whole = path.read_bytes()
        path.chmod(stat.S_IWRITE | stat.S_IREAD)
        for damaged in (None, b"", whole[: len(whole) // 2], b"x" * len(whole)):
            path.unlink(missing_ok=True)
            if damaged is not None:
                path.write_bytes(damaged)
            found = compare(capsys, "r/p", "--against", "git:HEAD~1")[:2]
            assert found in (FAILED, BROKEN)
            expected.add(found[0])
        path.write_bytes(whole)
    assert expected == {1, 2}  # not all objects are of the first commit


@pytest.mark.skipif(os.name == "nt", reason="links need a right of their own")
def test_links_of_a_revision_are_followed_within_it(alone, capsys):
    folder = changed("r")
    write("outside/B.msg", "int32 a\n")
    (folder / "q").mkdir()
    for link, target in {
        "q/msg": "../p/msg",
        "p/msg/Out.msg": str(alone / "outside/B.msg"),
        "p/msg/Up.msg": "../../../outside/B.msg",
        "p/msg/Loop.msg": "Loop.msg",
        "p/srv": "/",
    }.items():
        (folder / link).symlink_to(target)
    git("add", ".", cwd=folder)
    git("commit", "-qm", "links", cwd=folder)
    for name in ("p/msg/Loop.msg", "p/srv"):
        (folder / name).unlink()
    status, codes, _ = compare(capsys, "r", "--against", "git:HEAD")
    assert (status, codes) == (1, ["IDL601", "IDL601"])
    # now the working tree's links are the user's
    git("rm", "-q", "--cached", "p/msg/Out.msg", "p/msg/Up.msg", cwd=folder)
    status, codes, summary = compare(capsys, "r", "--against", "git:HEAD")
    assert (status, codes, summary["added"]) == (1, ["IDL520"], [])
    assert [one[2:] for one in summary["not_compared"]] == ["msg/Out", "msg/Up"]
    write("r/p/msg/A.msg", "int8 a\n")
    status, codes, _ = compare(capsys, "r", "--against", "git:HEAD")
    assert (status, codes) == (1, ["IDL520", "IDL507"])


def test_submodules_are_said_not_to_be_compared(capsys):
    write("other/package.xml", "<package><name>other</name></package>")
    other = changed("other")
    folder = changed("r")
    git("submodule", "add", "-q", str(other.absolute()), "sub", cwd=folder)
    git("commit", "-qm", "sub", cwd=folder)
    names = ["other/msg/A", "other/msg/Same"]
    sub = folder / "sub"
    for change, expected in {
        lambda: None: names,
        (sub / ".git").unlink: ["sub"],  # its files are this repository's now
        lambda: shutil.rmtree(sub): ["sub"],
        sub.mkdir: [],  # it is not checked out
    }.items():
        change()
        status, codes, summary = compare(capsys, "r", "--against", "git:HEAD")
        found = (status, codes, summary["not_compared"])
        assert found == ((1, ["IDL520"], expected) if expected else (0, [], []))
        assert compare(capsys, "r/p", "--against", "git:HEAD")[1] == []


@pytest.mark.parametrize("cone", ["--cone", "--no-cone"])
def test_what_a_sparse_checkout_leaves_out_is_said_not_to_be_compared(cone, capsys):
    folder = changed("r")
    write(folder / "p/package.xml", "<package><name>p</name></package>")
    write(folder / "ü q/package.xml", "<package><name>q</name></package>")
    write(folder / "ü q/msg/Left.msg", "p/A[] all\n")
    git("add", ".", cwd=folder)
    git("commit", "-qm", "q", cwd=folder)
    git("sparse-checkout", "init", cone, cwd=folder)
    git("sparse-checkout", "set", "p" if cone == "--cone" else "/p/", cwd=folder)
    assert not (folder / "ü q").exists()
    expected = (1, ["IDL520"], ["q/msg/Left"])
    status, codes, summary = compare(capsys, "r", "--against", "git:HEAD")
    assert (status, codes, summary["not_compared"]) == expected
    (folder / "p/msg/Same.msg").unlink()  # which is removed, not left out
    status, codes, summary = compare(capsys, "r", "--against", "git:HEAD")
    assert (status, sorted(codes)) == (1, ["IDL501", "IDL520"])
    write(folder / "p/msg/Same.msg", "int8 same\n")
    for place in ("ü q", "elsewhere/q"):  # there although the index leaves it out, or moved
        write(folder / place / "package.xml", "<package><name>q</name></package>")
        write(folder / place / "msg/Left.msg", "p/A all\n")
        status, codes, _ = compare(capsys, "r", "--against", "git:HEAD")
        assert (status, codes) == (1, ["IDL507"])
        shutil.rmtree(folder / place)


def tree(*entries):
    """Store a tree as it is given, in whatever order; return its name."""
    lines = b"".join(b"%s %s\0%s" % (mode, name, bytes.fromhex(one)) for mode, name, one in entries)
    words = ("hash-object", "-w", "-t", "tree", "--literally", "--stdin")
    return git(*words, given=lines).decode().strip()


@pytest.fixture
def stored(monkeypatch):
    """In a repository, return a revision for a tree."""
    monkeypatch.chdir(changed("r"))
    return lambda name: git("commit-tree", "-m", "x", name).decode().strip()


def test_few_bytes_that_name_endless_files(stored, monkeypatch, capsys):
    monkeypatch.setattr(revision, "MOST", 1 << 20)
    blob = git("hash-object", "-w", "--stdin", given=b"int32 a\n").decode().strip()
    name = tree((b"100644", b"A.msg", blob))
    for _ in range(9):
        name = tree(*((b"40000", b"%d" % at, name) for at in range(10)))
    assert compare(capsys, "p", "--against", f"git:{stored(name)}")[:2] == FAILED


@pytest.mark.parametrize("name", [b"..", b"../x", b"/", b"a/../../x", b"A.msg", b".git"])
def test_trees_that_git_would_not_make(stored, name, alone, capsys):
    blob = git("hash-object", "-w", "--stdin", given=b"int32 a\n").decode().strip()
    inner = tree((b"100644", b"A.msg", blob))
    link = git("hash-object", "-w", "--stdin", given=b"A.msg").decode().strip()
    first, *others = ((b"100644", blob), (b"40000", inner), (b"120000", link))
    named = [(mode, name, one) for mode, one in (*others, first)]
    before = sorted(alone.rglob("A.msg"))
    for entries in (named, *([one] for one in named)):
        whole = tree((b"100644", b"A.msg", blob), *entries)
        status, codes, _ = compare(capsys, ".", "--against", f"git:{stored(whole)}")
        assert (status, codes) == FAILED or set(codes) <= {"IDL501", "IDL502", "IDL507"}
        assert sorted(alone.rglob("A.msg")) == before


@pytest.mark.skipif(os.name == "nt", reason="links need a right of their own")
def test_a_chain_of_links_costs_what_its_links_do(stored, monkeypatch, capsys):
    links = (git("hash-object", "-w", "--stdin", given=b"%04d" % at) for at in range(1, 201))
    entries = [(b"120000", b"%04d" % at, name.decode().strip()) for at, name in enumerate(links)]
    blob = git("hash-object", "-w", "--stdin", given=b"int32 a\n").decode().strip()
    inner = tree((b"100644", b"A.msg", blob))
    name = stored(tree(*entries, (b"40000", b"0200", inner), (b"40000", b"p", inner)))
    followed = []
    readlink = os.readlink
    monkeypatch.setattr(os, "readlink", lambda *a, **b: followed.append(a) or readlink(*a, **b))
    assert compare(capsys, "p", "--against", f"git:{name}")[0] == 1
    assert len(followed) < 50 * 41


def test_a_broken_file_is_repaired_and_the_rest_is_compared(stored, capsys):
    """The first error is told with its place; both sides may have some."""
    write("p/msg/B.msg", "A a\n")
    write("p/msg/A.msg", "int46 a\n")
    git("add", ".")
    git("commit", "-qm", "broken")
    write("p/msg/A.msg", "int64 a\n")
    status, codes, summary = compare(capsys, "p", "--against", "git:HEAD")
    assert (status, codes) == (1, ["IDL520"])
    assert (summary["not_compared"], summary["part"]) == (["p/msg/A", "p/msg/B"], None)
    write("p/msg/Same.msg", "int16 same\n")
    assert compare(capsys, "p", "--against", "git:HEAD")[:2] == (1, ["IDL520", "IDL507"])
    assert main(["breaking", "p", "--against", "git:HEAD"]) == 1
    assert "IDL201 at git:HEAD:p/msg/A.msg:1: unknown type `int46`" in capsys.readouterr().out
    write("p/msg/A.msg", "int46 a\n")
    assert compare(capsys, "p", "--against", "git:HEAD")[:2] == (1, ["IDL520", "IDL201", "IDL507"])
    write(
        "pyproject.toml",
        """\
[[tool.idlc.breaking.allow]]
at = "p/msg/A"
reason = "it may be needed: nobody knows"
until = 2999-12-31
""",
    )
    assert "IDL517" not in compare(capsys, "p", "--against", "git:HEAD")[1]


@pytest.mark.usefixtures("stored")
@pytest.mark.parametrize(
    "content", [b"\xff\xfe", b"int8 a\n" * 500_001, b"#" * (16 << 20) + b"##"], ids=len
)
def test_an_old_file_that_cannot_be_read_is_said_not_to_be_compared(content, capsys):
    write("p/package.xml", "<package><name>p</name></package>")
    Path("p/msg/A.msg").write_bytes(content)
    write("p/other/msg/Same.msg", "int8 same\n")  # there twice
    git("add", ".")
    git("commit", "-qm", "unreadable")
    shutil.rmtree("p/other")
    write("p/msg/A.msg", "int64 a\n")
    write("p/msg/Same.msg", "int64 same\n")
    status, codes, summary = compare(capsys, "p", "--against", "git:HEAD")
    expected = (1, ["IDL520"], ["p/msg/A", "p/msg/Same"])
    assert (status, codes, summary["not_compared"]) == expected
