"""What a folder that is checked again and again asks its rules about."""

import pytest

from idlc.compiler.verdicts import IncrementalFindings
from idlc.editor.workspace import EditorSettings, Workspace

FILES = {
    "A.msg": "B b\n",
    "B.msg": "C c\nMissing m\n",
    "C.msg": "D d\n",
    "D.msg": "C c\n",  # a circle
    "E.msg": "int8 x\n",
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "package.xml").write_text("<package><name>demo</name></package>")
    (tmp_path / "msg").mkdir()
    for name, text in FILES.items():
        (tmp_path / "msg" / name).write_text(text)
    return tmp_path.resolve()


@pytest.mark.parametrize(
    ("changed", "text", "kept"),
    [
        ("A.msg", "B b\nint8 x\n", "BCDE"),
        ("B.msg", "C c\n", "CDE"),
        ("D.msg", "C c\nint8 x\n", "E"),
        ("E.msg", "C c\n", "ABCD"),
    ],
)
def test_only_what_depends_on_a_change_is_asked_about_again(
    folder, monkeypatch, changed, text, kept
):
    workspace = Workspace(folder, EditorSettings(), dict)
    workspace.snapshot()
    seen = []

    def of(self, model):
        found = real(self, model)
        seen.append("".join(sorted(name.name for name in found)))
        return found

    real = IncrementalFindings.still_valid
    monkeypatch.setattr(IncrementalFindings, "still_valid", of)
    workspace.follow(folder / "msg" / changed, text.encode())
    after = workspace.snapshot()
    assert set(seen) == {kept}
    fresh = Workspace(folder, EditorSettings(), dict)
    (folder / "msg" / changed).write_text(text)
    told, expected = (
        [(one.code, one.message, one.where) for one in state.problems]
        for state in (after, fresh.snapshot())
    )
    assert told == expected
