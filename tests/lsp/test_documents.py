"""Problems of documents as an editor opens, changes, saves and closes them."""

from lsprotocol import types as lsp

from tests.support.editor import between


def test_problems_are_told_as_one_types(editor, package):
    folder = package({"msg/Drive.msg": "float64 speed\n"})
    one = editor(folder)
    uri = one.open(folder / "msg/Drive.msg")
    one.change(uri, "flot64 speed\n", 2)
    (found,) = one.wait(uri, 2)
    assert (found.code, found.severity) == ("IDL201", lsp.DiagnosticSeverity.Error)
    assert found.range == between(0, 0, 6)
    assert "hint: did you mean `float64`?" in found.message
    one.change(uri, "a", 3, between(0, 3, 3))
    assert one.wait(uri, 3) == []
