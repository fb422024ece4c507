"""Messages get other names, by the server and by the editor, undone and done again.

Whatever an editor does around it, what its user sees is afterwards what was asked for.
"""

import random
import re
from pathlib import Path

import pytest
from lsprotocol import types as lsp

from idlc.editor.protocol import ADD_DEPENDENCY, RequestError
from idlc.editor.workspace import EditorSettings, Workspace
from tests.editors.scenario import RENAMED, RENAMING, write
from tests.support.rounds import some
from tests.support.simulated import BEHAVIOURS, Server, Simulated, path_of


@pytest.fixture(params=BEHAVIOURS)
def client(request, tmp_path):
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    return Simulated(folder, BEHAVIOURS[request.param])


def rename(client, old="Pose", new="Waypoint"):
    edit = client.ask_rename(client.folder / "fleet/msg/Robot.msg", 0, 6, new)
    assert edit is not None
    client.apply(edit, old)


@pytest.fixture(params=[name for name, one in BEHAVIOURS.items() if one.asks])
def asking(request, tmp_path):
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    return Simulated(folder, BEHAVIOURS[request.param])


def restore(client, files, old, new):
    """Undo: the file first, which no editor asks about, then the texts."""
    client.move_silently(client.folder / old, client.folder / new)
    for path, text in files.items():
        if client.text(client.folder / path) != text:
            client.write(client.folder / path, text)


@pytest.mark.parametrize("cmake", ["open", "closed"])
def test_rename_undo_redo(client, cmake):
    if cmake == "open":
        client.open(client.folder / "base/CMakeLists.txt")
    rename(client)
    assert client.files() == RENAMED
    restore(client, RENAMING, "base/msg/Waypoint.msg", "base/msg/Pose.msg")
    client.save(*client.texts)
    assert client.files() == RENAMING
    # redo: the texts first, and then the file, which VS Code asks about again
    for path, text in RENAMED.items():
        if path in RENAMING and RENAMING[path] != text:
            client.write(client.folder / path, text)
    client.move(client.folder / "base/msg/Pose.msg", client.folder / "base/msg/Waypoint.msg")
    assert client.files() == RENAMED


def test_a_file_that_is_renamed_long_after_the_edits(client):
    """As on a busy machine, when the server has looked around in between."""
    edit = client.ask_rename(client.folder / "fleet/msg/Robot.msg", 0, 6, "Waypoint")
    *edits, move = edit.document_changes
    client.apply(lsp.WorkspaceEdit(document_changes=edits), "Pose")
    client.server.rest()
    client.server.rest()
    assert "IDL201" in {code for _, code, _ in client.problems()}
    client.move_silently(path_of(move.old_uri), path_of(move.new_uri))
    client.server.rest()
    assert client.files() == RENAMED
    assert "IDL201" not in {code for _, code, _ in client.problems()}


def _replace(path, text):
    path.with_suffix(".new").write_text(text)
    path.with_suffix(".new").replace(path)


CHANGES = {
    "a new file": lambda folder: (folder / "base/msg/Bad.msg").write_text("flot64 x\n"),
    "a new folder": lambda folder: write(folder, {"more/deep/msg/Bad.msg": "flot64 x\n"}),
    "in place": lambda folder: (folder / "base/msg/Pose.msg").write_text("flot64 x\n"),
    "replaced": lambda folder: _replace(folder / "base/msg/Pose.msg", "flot64 x\n"),
    "removed": lambda folder: (folder / "base/msg/Pose.msg").unlink(),
    "a folder renamed": lambda folder: (folder / "base").rename(folder / ".base"),
    "package.xml": lambda folder: (folder / "base/package.xml").write_text("<package>"),
    "settings": lambda folder: (folder / "pyproject.toml").write_text("[tool.idlc]\nx = 1\n"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_changes_that_nobody_tells_of(tmp_path, change):
    """As a branch that is checked out in a terminal, for a client that watches nothing."""
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    client = Simulated(folder, BEHAVIOURS["neovim"])
    before = client.problems()
    CHANGES[change](folder)
    client.server.rest()
    assert client.problems() != before


def test_a_dependency_is_added_to_the_package_xml_that_is_on_disk(tmp_path):
    """In an editor that tells of interface files only, package.xml may be newer than known."""
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    client = Simulated(folder, BEHAVIOURS["neovim"])
    robot, xml = folder / "fleet/msg/Robot.msg", folder / "fleet/package.xml"
    client.open(robot)
    client.problems()
    xml.write_text("<!-- a licence that somebody added -->\n\n" + xml.read_text())
    words = {"command": ADD_DEPENDENCY, "arguments": [robot.as_uri(), "std_msgs"]}
    client.server.ask(lsp.WORKSPACE_EXECUTE_COMMAND, lsp.ExecuteCommandParams(**words))
    ((uri, edits),) = client.server.applied().changes.items()
    assert uri == xml.as_uri()
    lines = xml.read_text().split("\n")
    for one in edits:
        assert "<depend>base</depend>" in lines[one.range.start.line]  # after which it is put


@pytest.mark.parametrize("is_free", [True, False])
def test_a_file_gets_the_name_that_a_hint_says(client, is_free):
    msg, cmake = client.folder / "base/msg", client.folder / "base/CMakeLists.txt"
    (msg / "Track.msg").rename(msg / "way_track.msg")
    cmake.write_text(cmake.read_text().replace("Track", "way_track"))
    if not is_free:
        (msg / "WayTrack.msg").write_text("int8 x\n")
    client.open(msg / "way_track.msg")
    start = lsp.Range(lsp.Position(0, 0), lsp.Position(0, 0))
    asked = lsp.CodeActionParams(
        lsp.TextDocumentIdentifier((msg / "way_track.msg").as_uri()),
        start,
        lsp.CodeActionContext([]),
    )
    told = client.server.answer(lsp.TEXT_DOCUMENT_CODE_ACTION, asked)
    commands = [one["command"] for one in told if "Rename" in one["title"]]
    assert len(commands) == is_free
    for one in commands:
        assert one["title"] == "Rename the file to `WayTrack.msg`"
        params = lsp.ExecuteCommandParams(one["command"], arguments=one["arguments"])
        client.server.ask(lsp.WORKSPACE_EXECUTE_COMMAND, params)
        client.apply(client.server.applied(), "way_track")
        assert client.text(msg / "WayTrack.msg") == RENAMING["base/msg/Track.msg"]
        assert "msg/WayTrack.msg" in client.text(cmake)
        assert "way_track" not in str(client.files())


@pytest.mark.parametrize("name", ["neovim", "vscode"])
def test_what_is_read_anew_for_a_request_is_told(tmp_path, name):
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    client = Simulated(folder, BEHAVIOURS[name])
    robot = folder / "fleet/msg/Robot.msg"
    client.open(robot)
    (folder / "base/msg/Bad.msg").write_text("flot64 x\n")
    client.server.told.clear()
    client.ask_rename(robot, 0, 6, "Waypoint")
    client.server.publish_problems()
    assert (folder / "base/msg/Bad.msg").as_uri() in str(client.server.told)


def test_a_folder_that_is_gone_and_comes_back(tmp_path):
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    client = Simulated(folder, BEHAVIOURS["neovim"])
    before = client.problems()
    folder.rename(tmp_path / "elsewhere")
    client.server.rest()
    assert client.problems() == set()
    (tmp_path / "elsewhere").rename(folder)
    client.server.rest()
    assert client.problems() == before != set()


def test_the_folder_that_the_server_was_started_in_is_gone(tmp_path, monkeypatch):
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    client = Simulated(folder, BEHAVIOURS["neovim"])
    before = client.problems()
    try:
        here.rmdir()
    except OSError:
        pytest.skip("this system keeps the working folders of processes")
    client.open(folder / "base/msg/Pose.msg")
    client.write(folder / "base/msg/Pose.msg", "flot64 x\n")
    assert client.problems() > before
    rename(client, "Pose", "Waypoint")


def test_two_renames_in_a_row(client):
    rename(client)
    rename(client, "Waypoint", "Pose")
    assert client.files() == RENAMING


def test_a_renamed_file_alone(asking):
    asking.open(asking.folder / "fleet/msg/Robot.msg")
    asking.move(asking.folder / "base/msg/Pose.msg", asking.folder / "base/msg/Waypoint.msg")
    assert asking.files() == RENAMED
    asking.move(asking.folder / "base/msg/Waypoint.msg", asking.folder / "base/msg/Pose.msg")
    assert asking.files() == RENAMING


@pytest.mark.parametrize("again", ["Waypoint", "Other"])
def test_a_cancelled_rename_hides_no_later_one(asking, again):
    assert asking.ask_rename(asking.folder / "fleet/msg/Robot.msg", 0, 6, "Waypoint")
    asking.move(asking.folder / "base/msg/Pose.msg", asking.folder / f"base/msg/{again}.msg")
    expected = {path.replace("Waypoint", again): text for path, text in RENAMED.items()}
    assert asking.files() == {
        path: text.replace("Waypoint", again) for path, text in expected.items()
    }


def test_a_rename_counts_what_is_not_saved(client):
    robot = client.folder / "fleet/msg/Robot.msg"
    cmake = client.folder / "base/CMakeLists.txt"
    client.write(robot, "# far\n" + RENAMING["fleet/msg/Robot.msg"] + "base/Pose[] more\n")
    client.write(client.folder / "fleet/srv/Where.srv", "base/Pose a\n---\n")
    client.write(cmake, "# first\n" + RENAMING["base/CMakeLists.txt"])
    if not client.behaviour.syncs_cmake:
        client.save(cmake)
    edit = client.ask_rename(robot, 1, 6, "Waypoint")
    client.apply(edit, "Pose")
    texts = client.files()
    assert not any(re.search(r"\bPose\b", text) for text in texts.values())
    assert texts["base/CMakeLists.txt"] == "# first\n" + RENAMED["base/CMakeLists.txt"]


def test_files_that_changed_unnoticed(client):
    """A branch is checked out in a terminal, and the server has not been told yet."""
    rename(client)
    client.save(*client.texts)
    for path in list(client.texts):
        client.close(path)
    track = client.folder / "base/msg/Track.msg"
    track.write_text("# new\n\nWaypoint[] poses\n")
    rename(client, "Waypoint", "Pose")
    assert client.text(track) == "# new\n\nPose[] poses\n"


@pytest.mark.parametrize("name", BEHAVIOURS)
def test_a_file_in_two_folders_of_the_workspace(tmp_path, name):
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    roots = folder, folder / "base", folder / "fleet"
    client = Simulated(folder, BEHAVIOURS[name], roots)
    rename(client)
    assert client.files() == RENAMED


def test_a_folder_and_a_link_to_it_in_one_workspace(client):
    """Each file is edited once, or the second edit would be of what the first one wrote."""
    (client.folder.parent / "link").symlink_to(client.folder)
    roots = client.folder, client.folder.parent / "link"
    client = Simulated(client.folder, client.behaviour, roots)
    edit = client.ask_rename(client.folder / "fleet/msg/Robot.msg", 0, 6, "Waypoint")
    files = [path_of(one.text_document.uri).resolve() for one in edit.document_changes[:-1]]
    assert len(files) == len(set(files))
    client.apply(edit, "Pose")
    assert client.files() == RENAMED


@pytest.mark.parametrize("is_kept", [False, True])
@pytest.mark.parametrize("name", BEHAVIOURS)
def test_positions_after_a_byte_order_mark(tmp_path, name, is_kept):
    """Editors drop the mark when they read a file; one that keeps it counts it."""
    cmake = "\ufeff" + RENAMING["base/CMakeLists.txt"].replace("\n", " ") + "\n# msg/Pose.msg.in\n"
    files = {**RENAMING, "base/CMakeLists.txt": cmake}
    folder = write(tmp_path.resolve() / "workspace", files)
    client = Simulated(folder, BEHAVIOURS[name]._replace(syncs_cmake=is_kept))
    client.coding = "utf-8" if is_kept else "utf-8-sig"
    if is_kept:
        client.open(folder / "base/CMakeLists.txt")
    rename(client)
    expected = cmake if is_kept else cmake[1:]
    assert client.text(folder / "base/CMakeLists.txt") == expected.replace(
        'Pose.msg"', 'Waypoint.msg"'
    )


@pytest.mark.parametrize("asking", ["one", "two"])
def test_a_message_of_that_name_in_another_folder_is_another(tmp_path, asking):
    """As in two checkouts of one workspace, which an editor has open side by side."""
    folder = write(tmp_path.resolve(), {f"one/{path}": text for path, text in RENAMING.items()})
    write(folder, {f"two/{path}": text for path, text in RENAMING.items()})
    client = Simulated(folder, BEHAVIOURS["vscode"], (folder / "one", folder / "two"))
    edit = client.ask_rename(folder / asking / "fleet/msg/Robot.msg", 0, 6, "Waypoint")
    client.apply(edit, "Pose")
    expected = {name: RENAMED if name == asking else RENAMING for name in ("one", "two")}
    assert client.files() == {
        f"{name}/{path}": text for name, files in expected.items() for path, text in files.items()
    }


def test_an_editor_that_cannot_rename_files(tmp_path):
    """As Emacs 28 without rosmsg-mode.el: nothing rather than a half."""
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    client = Simulated(folder, BEHAVIOURS["emacs"]._replace(resource_operations=()))
    with pytest.raises(RequestError, match=r"rosmsg-mode\.el"):
        rename(client)
    assert client.ask_rename(folder / "base/msg/Pose.msg", 0, 8, "y").document_changes


def test_the_same_name_changes_nothing(client):
    assert client.ask_rename(client.folder / "fleet/msg/Robot.msg", 0, 6, "Pose") is None


@pytest.mark.parametrize("new", ["", "../X", "Pose/..", "pose", "A b", "Track", "X" * 300])
def test_names_that_are_refused(client, new):
    with pytest.raises(RequestError, match=r"not a valid name|already|too long"):
        client.ask_rename(client.folder / "fleet/msg/Robot.msg", 0, 6, new)


@pytest.mark.parametrize("make", [Path.mkdir, lambda path: path.symlink_to("nowhere")])
def test_names_of_what_is_no_file(client, make):
    """A rename would fail after its edits, or replace a link."""
    make(client.folder / "base/msg/Waypoint.msg")
    with pytest.raises(RequestError, match="already"):
        rename(client)


def test_a_file_that_is_named_twice(asking):
    client = asking
    client.open(client.folder / "fleet/msg/Robot.msg")
    old, new = (client.folder / f"base/msg/{name}.msg" for name in ("Pose", "Waypoint"))
    moved = lsp.FileRename(old_uri=old.as_uri(), new_uri=new.as_uri())
    params = lsp.RenameFilesParams(files=[moved, moved])
    client.apply(client.server.ask(lsp.WORKSPACE_WILL_RENAME_FILES, params), "Pose")
    client.move_silently(old, new)
    assert client.files() == RENAMED


def test_names_that_no_message_can_have(asking):
    asking.open(asking.folder / "fleet/msg/Robot.msg")
    asking.move(asking.folder / "base/msg/Pose.msg", asking.folder / "base/msg/pose 2.msg")
    assert asking.text(asking.folder / "fleet/msg/Robot.msg") == RENAMING["fleet/msg/Robot.msg"]


def test_a_build_file_that_cannot_be_read(client):
    cmake = client.folder / "base/CMakeLists.txt"
    cmake.write_bytes(RENAMING["base/CMakeLists.txt"].encode() + b"# \xff\n")
    with pytest.raises(RequestError, match=r"idlc renamed nothing: .*CMakeLists\.txt"):
        rename(client)


def test_a_rename_says_which_types_get_another_hash(client):
    """Of all that reach the message, not only of its users."""
    folder = client.folder
    (folder / "fleet/msg/Fleet.msg").write_text("Robot[] robots\n")
    (folder / "fleet/msg/Other.msg").write_text("int8 x\n")
    edit = client.ask_rename(folder / "base/msg/Pose.msg", 0, 8, "y")
    if edit.change_annotations:
        (said,) = (one.description for one in edit.change_annotations.values())
    else:
        (said,) = (words[1]["message"] for words in client.server.told if "message" in str(words))
    # Pose, Track, Robot, Where, Fleet
    assert "base/msg/Track, fleet/msg/Robot, fleet/srv/Where" in said
    assert said.endswith("changes the type hash of 5 interfaces")


def test_a_rename_among_errors_does_not_claim_to_break_nothing(client):
    path = client.folder / "base/msg/Pose.msg"
    client.open(path)
    client.write(path, RENAMING["base/msg/Pose.msg"] + "flot64 z\n")
    edit = client.ask_rename(path, 0, 8, "y")
    said = str(edit.change_annotations or client.server.told)
    assert "breaks nothing" not in said
    assert "because of errors" in said


REFRESHED = lsp.WorkspaceClientCapabilities(
    inlay_hint=lsp.InlayHintWorkspaceClientCapabilities(refresh_support=True),
    code_lens=lsp.CodeLensWorkspaceClientCapabilities(refresh_support=True),
    semantic_tokens=lsp.SemanticTokensWorkspaceClientCapabilities(refresh_support=True),
)


@pytest.mark.parametrize("is_open", [True, False])
def test_what_is_shown_is_fresh_after_a_nested_type_changed(tmp_path, is_open):
    folder = write(tmp_path.resolve() / "workspace", RENAMING)
    client = Simulated(folder, BEHAVIOURS["vscode"])
    client.server = Server(folder, capabilities=lsp.ClientCapabilities(workspace=REFRESHED))
    pose, robot = folder / "base/msg/Pose.msg", folder / "fleet/msg/Robot.msg"
    client.open(robot)

    def change(path, text):
        client.server.told.clear()
        if is_open or path == robot:
            client.write(path, text)
        else:
            path.write_text(text)
            client.tell_of_changes([path])
        client.server.rest()
        return {words[0] for words in client.server.told if words[0].endswith("/refresh")}

    every = {f"workspace/{one}/refresh" for one in ("inlayHint", "codeLens", "semanticTokens")}
    assert change(pose, "float32 x\n") == every
    assert change(pose, "float32 x  # [m]\n") == set()  # nothing else looks different
    assert change(robot, "base/Pose pose\nbase/Pose other\n") == set()  # of which the client knows
    assert change(pose, "float32 y\n") == every  # another hash
    assert change(pose, "flot32 y\n") == every
    assert change(pose, "float32 y\n") == every


@pytest.mark.parametrize("seed", some(range(4)))
def test_any_sequence(client, seed):
    Sequence(client, random.Random(seed)).run(15)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(100, 104))
def test_any_long_sequence(client, seed):
    Sequence(client, random.Random(seed)).run(60)


class Sequence:
    """Random work of a user; after each step, the server knows what a new one would."""

    def __init__(self, client: Simulated, choose: random.Random) -> None:
        self.client = client
        self.choose = choose
        self.folder = client.folder
        self.cmake = self.folder / "base/CMakeLists.txt"
        self.count = 0

    def run(self, steps: int) -> None:
        for _ in range(steps):
            kinds = [self.edit, self.save, self.close, self.rename, self.rename, self.cancel]
            if self.client.behaviour.asks:
                kinds.append(self.move)
            step = self.choose.choice(kinds)
            step()
            self.check(step.__name__)

    def interfaces(self):
        return sorted(one for kind in ("msg", "srv") for one in self.folder.rglob(f"*.{kind}"))

    def fresh_name(self) -> str:
        self.count += 1
        return f"{self.choose.choice(['Pose', 'P', 'LongerName'])}{self.count}"

    def uses(self):
        """Yield each place that names a message of the workspace."""
        for path in self.interfaces():
            for number, line in enumerate(self.client.text(path).split("\n")):
                if match := re.match(r"(?:base/)?([A-Z]\w*)[^ ]* ", line):
                    yield path, number, match.start(1), match[1]

    def edit(self) -> None:
        path = self.choose.choice([*self.interfaces(), self.cmake])
        self.count += 1
        more = "# more\n" if path == self.cmake else f"uint8 more{self.count}\n"
        self.client.open(path)
        self.client.write(path, more + self.client.text(path))
        if path == self.cmake and not self.client.behaviour.syncs_cmake:
            self.client.save(path)

    def save(self) -> None:
        if self.client.texts:
            self.client.save(self.choose.choice(sorted(self.client.texts)))

    def close(self) -> None:
        clean = [path for path, text in self.client.texts.items() if path.read_text() == text]
        if clean:
            self.client.close(self.choose.choice(sorted(clean)))

    def cancel(self) -> None:
        path, line, column, _ = self.choose.choice(list(self.uses()))
        self.client.ask_rename(path, line, column, self.fresh_name())

    def rename(self) -> None:
        path, line, column, old = self.choose.choice(list(self.uses()))
        before = self.client.files()
        edit = self.client.ask_rename(path, line, column, self.fresh_name())
        self.client.apply(edit, old)
        if self.choose.random() < 0.5:
            self.undo(before)

    def undo(self, before) -> None:
        after = self.client.files()
        (old,) = before.keys() - after.keys()
        (new,) = after.keys() - before.keys()
        restore(self.client, before, new, old)
        self.saved_if_not_synced()
        assert self.client.files() == before
        if self.choose.random() < 0.5:
            self.check("undo")
            for path in before.keys() & after.keys():
                if before[path] != after[path]:
                    self.client.write(self.folder / path, after[path])
            self.client.move(self.folder / old, self.folder / new)
            self.saved_if_not_synced()
            assert self.client.files() == after

    def saved_if_not_synced(self) -> None:
        if not self.client.behaviour.syncs_cmake and self.cmake in self.client.texts:
            self.client.save(self.cmake)

    def move(self) -> None:
        old = self.choose.choice([one for one in self.interfaces() if one.suffix == ".msg"])
        self.client.move(old, old.with_name(f"{self.fresh_name()}.msg"))

    def check(self, step: str) -> None:
        texts = self.client.files()
        named = set(re.findall(r'"(msg/\w+\.msg)"', texts["base/CMakeLists.txt"]))
        there = {one.removeprefix("base/") for one in texts if one.startswith("base/msg/")}
        assert named == there, step
        overlaid = {path: text.encode() for path, text in self.client.texts.items()}
        workspace = Workspace(self.folder, EditorSettings(), lambda: overlaid)
        snapshot = workspace.snapshot()
        expected = set()
        for one in snapshot.problems:
            assert one.code != "IDL201", (step, one.message)
            line = one.span.source.position(one.span.start)[0] - 1 if one.span else 0
            path = snapshot.path_of(one.span.source) if one.span else snapshot.folder / one.path
            expected.add((path.relative_to(self.folder).as_posix(), one.code, line))
        self.client.server.rest()
        assert self.client.problems() == expected, step
