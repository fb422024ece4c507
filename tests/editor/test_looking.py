"""What an editor shows of a file: hover, definitions, references, symbols, layout."""

import html
import random
import re

import pytest
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException

from idlc.editor.descriptions import prose
from tests.support.editor import at, between

CONTENT = lsp.WORKSPACE_TEXT_DOCUMENT_CONTENT

DRIVE = """\
# How to drive.

uint8 MODE_FAST=2  # as fast as can be
uint8 mode 2  # MODE_FAST or another [1]
float64 speed 0.5  # forwards [m/s]
string<=10[<=3] names
Wheel wheel
std_msgs/Header header
"""
FILES = {
    "msg/Drive.msg": DRIVE,
    "msg/Wheel.msg": "# A wheel.\nfloat32 radius  # [m]\n",
    "srv/Stop.srv": "Wheel[] wheels\n---\nbool ok\n",
}


@pytest.fixture(scope="module")
def server(editor, package):
    folder = package(FILES)
    return editor(folder), folder


@pytest.fixture
def opened(server):
    one, folder = server
    uri = one.open(folder / "msg/Drive.msg")
    yield one, uri, folder
    one.close(uri)


def document(uri):
    return lsp.TextDocumentIdentifier(uri=uri)


def ask(one, method, kind, uri, line, character, **more):
    params = kind(text_document=document(uri), position=at(line, character), **more)
    return one.ask(method, params)


def hover(opened, line, character):
    one, uri, _ = opened
    found = ask(one, lsp.TEXT_DOCUMENT_HOVER, lsp.HoverParams, uri, line, character)
    return found and (found.contents.value, found.range)


def test_hover_says_what_a_field_is(opened):
    text, where = hover(opened, 4, 10)
    assert where == between(4, 8, 13)
    assert "```rosmsg\nfloat64 speed 0.5\n```" in text
    assert "forwards" in text
    assert "unit: `m/s`" in text
    assert "on the wire: 8 bytes at offset 8" in text
    text, _ = hover(opened, 3, 7)
    assert "range: `0` to `255`" in text
    assert "default: `2`" in text
    assert "on the wire: 1 byte at offset" in text
    text, _ = hover(opened, 5, 17)
    assert "length: at most 10 characters" in text
    assert "elements: at most 3" in text
    text, _ = hover(opened, 2, 8)
    assert "uint8 MODE_FAST=2" in text
    assert "as fast as can be" in text


def test_hover_shows_a_type_with_its_fields_bytes_and_hash(opened):
    text, where = hover(opened, 6, 2)
    assert where == between(6, 0, 5)
    assert "**demo/msg/Wheel**" in text
    assert "float32 radius" in text
    assert "4 bytes" in text
    assert "`RIHS01_" in text
    text, _ = hover(opened, 7, 0)
    assert "**std_msgs/msg/Header**" in text
    assert "    int32 sec" in text
    text, where = hover(opened, 1, 0)  # between definitions, it is the file itself
    assert "**demo/msg/Drive**" in text
    assert where is None


def test_text_of_a_comment_is_no_markup(opened):
    one, uri, _ = opened
    one.change(uri, "int8 x  # <b>*`_\n")
    text, _ = hover(opened, 0, 5)
    assert r"\<b>\*\`_" in text


@pytest.mark.parametrize(
    "text", ["one of STATUS_*", "a_b_c - [m/s]", "`speed` (1.5 m) & co", "x < y > z, 1 * 2"]
)
def test_what_markdown_shows_as_it_is_stays(text):
    assert prose((text,)) == text


PIECES = [
    *"*_~`[]()<>&#+-=|.!:\\1a ",
    *(
        "word",
        "STATUS_*",
        "http://x.y",
        "&amp;",
        "<b>",
        "1.",
        "2)",
        "---",
        "===",
        "](u)",
        "[a]:",
        "```",
    ),
]


@pytest.mark.parametrize("seed", range(20))
def test_markdown_shows_any_comment_as_it_was_written(seed):
    render = pytest.importorskip("markdown_it").MarkdownIt("commonmark")
    render.enable(["table", "strikethrough"])
    choose = random.Random(seed)
    for _ in range(100):
        lines = tuple(
            "".join(choose.choices(PIECES, k=choose.randrange(1, 9))).strip() or "x"
            for _ in range(choose.randrange(1, 4))
        )
        shown = render.render(prose(lines))
        assert {*re.findall(r"<(\w+)", shown)} <= {"p", "br", "code"}, lines
        text = html.unescape(re.sub(r"<[^>]*>", "", shown))
        written = (re.sub(r"(?<!`)`([^`]+)`(?!`)", r"\1", line) for line in lines)
        assert text.split() == " ".join(written).split(), lines


def test_a_range_in_brackets_is_called_one(opened):
    one, uri, _ = opened
    for text in ("0..1", "-1.5 .. 1.5", "0-255", "0 to 100", ">= 0", "-pi..pi"):
        one.change(uri, f"uint8 x  # [{text}] how much\n")
        shown, _ = hover(opened, 0, 6)
        assert f"range: `{text}`" in shown
        assert "unit" not in shown
        assert "range: `0` to" not in shown
    for text in ("m/s", "1/s", "m-1", "kg m^2", "1e-3 m", "%"):
        one.change(uri, f"uint8 x  # [{text}]\n")
        assert f"unit: `{text}`" in hover(opened, 0, 6)[0]


def test_hover_marks_what_is_deprecated(opened):
    one, uri, _ = opened
    one.change(uri, "float64 x  # [m] deprecated: use y\nfloat64 y  # is not deprecated: x is\n")
    shown, _ = hover(opened, 0, 8)
    assert "**Deprecated**\n\ndeprecated: use y" in shown
    assert "**Deprecated**" not in hover(opened, 1, 8)[0]


def test_a_definition_is_found_where_it_is(opened):
    one, uri, folder = opened
    for method in (lsp.TEXT_DOCUMENT_DEFINITION, lsp.TEXT_DOCUMENT_TYPE_DEFINITION):
        found = ask(one, method, lsp.DefinitionParams, uri, 6, 3)
        assert found == lsp.Location(
            uri=(folder / "msg/Wheel.msg").as_uri(), range=between(0, 0, 0)
        )
    found = ask(one, lsp.TEXT_DOCUMENT_DEFINITION, lsp.DefinitionParams, uri, 6, 8)
    assert found.range == between(6, 6, 11)
    found = ask(one, lsp.TEXT_DOCUMENT_TYPE_DEFINITION, lsp.DefinitionParams, uri, 6, 8)
    assert found.uri.endswith("Wheel.msg")


SHOWS_TEXTS = lsp.ClientCapabilities(
    workspace=lsp.WorkspaceClientCapabilities(
        text_document_content=lsp.TextDocumentContentClientCapabilities()
    )
)


def test_what_is_built_in_is_a_document_of_its_own(editor, package):
    folder = package({"msg/Plan.msg": "shape_msgs/Plane plane\n"})
    one = editor(folder, options={"idlc": {"distro": "jazzy"}}, capabilities=SHOWS_TEXTS)
    uri = one.open(folder / "msg/Plan.msg")
    found = ask(one, lsp.TEXT_DOCUMENT_DEFINITION, lsp.DefinitionParams, uri, 0, 3)
    assert found.uri == "idlc:/jazzy/shape_msgs/msg/Plane.msg"
    answer = one.ask(CONTENT, lsp.TextDocumentContentParams(uri=found.uri))
    assert answer.text == "float64[4] coef\n"
    with pytest.raises(JsonRpcException, match="there is no document"):
        one.ask(CONTENT, lsp.TextDocumentContentParams(uri="idlc:/jazzy/../../etc/passwd"))


def test_an_editor_that_shows_files_only_gets_one(editor, package, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = package({"msg/Plan.msg": "shape_msgs/SolidPrimitive solid\nshape_msgs/Plane plane\n"})
    one = editor(folder, options={"idlc": {"distro": "jazzy"}})
    uri = one.open(folder / "msg/Plan.msg")
    params = lsp.DocumentLinkParams(text_document=document(uri))
    assert one.ask(lsp.TEXT_DOCUMENT_DOCUMENT_LINK, params) == ()
    assert not list(tmp_path.rglob("*.msg"))
    found = ask(one, lsp.TEXT_DOCUMENT_DEFINITION, lsp.DefinitionParams, uri, 1, 3)
    path = tmp_path / "idlc/interfaces/jazzy/shape_msgs/msg/Plane.msg"
    assert found.uri == path.as_uri()
    assert path.read_text() == "float64[4] coef\n"
    assert path.stat().st_mode & 0o777 == 0o444
    assert one.pull(one.open(path)) == []
    assert hover((one, found.uri, None), 0, 12)
    path.unlink()
    path.write_text("edited\n")
    ask(one, lsp.TEXT_DOCUMENT_DEFINITION, lsp.DefinitionParams, uri, 1, 3)
    assert path.read_text() == "float64[4] coef\n"


MANIFEST = """\
<package format="3">
  <name>one</name>
  <depend>two</depend>
  <exec_depend> shape_msgs </exec_depend>
  <depend>unheard_of</depend>
</package>
"""


def test_package_xml_leads_to_packages_and_to_their_users(editor, package, monkeypatch):
    other = MANIFEST.replace("two", "three").replace("<name>one", "<name>two")
    files = {"one/package.xml": MANIFEST, "two/package.xml": other, "two/msg/B.msg": "int8 x\n"}
    folder = package({**files, "one/msg/A.msg": "two/B b\nshape_msgs/Plane plane\n"})
    (folder / "package.xml").unlink()
    one = editor(folder, capabilities=SHOWS_TEXTS)
    uri = one.open(folder / "one/package.xml", language="xml")

    def leads_to(line, character):
        found = ask(one, lsp.TEXT_DOCUMENT_DEFINITION, lsp.DefinitionParams, uri, line, character)
        return found and found.uri

    assert leads_to(2, 10) == leads_to(2, 13) == (folder / "two/package.xml").as_uri()
    assert leads_to(1, 8) == uri
    assert leads_to(3, 18).startswith("idlc:/jazzy/shape_msgs/msg/")
    assert leads_to(4, 12) is None
    assert leads_to(2, 3) is None
    context = lsp.ReferenceContext(include_declaration=True)
    found = ask(one, lsp.TEXT_DOCUMENT_REFERENCES, lsp.ReferenceParams, uri, 2, 11, context=context)
    assert [(each.uri.removeprefix(folder.as_uri()), each.range) for each in found] == [
        ("/one/msg/A.msg", between(0, 0, 5)),
        ("/one/package.xml", between(2, 10, 13)),
        ("/two/package.xml", between(1, 8, 11)),
    ]
    one.change(uri, MANIFEST.replace("two", "shape_msgs"))
    assert leads_to(2, 12).startswith("idlc:/jazzy/shape_msgs/msg/")


def test_references_are_those_of_every_file(opened):
    one, uri, _ = opened
    context = lsp.ReferenceContext(include_declaration=True)
    found = ask(one, lsp.TEXT_DOCUMENT_REFERENCES, lsp.ReferenceParams, uri, 6, 3, context=context)
    assert [(one.uri.rpartition("/")[2], one.range) for one in found] == [
        ("Wheel.msg", between(0, 0, 0)),
        ("Drive.msg", between(6, 0, 5)),
        ("Stop.srv", between(0, 0, 5)),
    ]
    found = ask(one, lsp.TEXT_DOCUMENT_REFERENCES, lsp.ReferenceParams, uri, 2, 10, context=context)
    assert [one.range for one in found] == [between(2, 6, 15), between(3, 16, 25)]
    found = ask(one, lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT, lsp.DocumentHighlightParams, uri, 2, 10)
    assert [one.kind for one in found] == [
        lsp.DocumentHighlightKind.Write,
        lsp.DocumentHighlightKind.Read,
    ]


def test_package_xml_refers_to_the_packages_of_types(editor, package):
    manifest = "<package>\n  <name>demo</name>\n  <depend>std_msgs</depend>\n</package>\n"
    folder = package({"package.xml": manifest, "msg/A.msg": "std_msgs/Header header\n"})
    one = editor(folder)
    uri = one.open(folder / "msg/A.msg")
    context = lsp.ReferenceContext(include_declaration=False)
    found = ask(one, lsp.TEXT_DOCUMENT_REFERENCES, lsp.ReferenceParams, uri, 0, 3, context=context)
    assert [(each.uri.rpartition("/")[2], each.range) for each in found] == [
        ("A.msg", between(0, 0, 15)),
        ("package.xml", between(2, 2, 10)),
    ]


def test_symbols_of_a_file_are_its_definitions(opened):
    one, uri, folder = opened
    params = lsp.DocumentSymbolParams(text_document=document(uri))
    found = one.ask(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL, params)
    assert [(each.name, each.detail) for each in found] == [
        ("MODE_FAST", "uint8"),
        ("mode", "uint8"),
        ("speed", "float64"),
        ("names", "string<=10[<=3]"),
        ("wheel", "demo/Wheel"),
        ("header", "std_msgs/Header"),
    ]
    uri = (folder / "srv/Stop.srv").as_uri()
    params = lsp.DocumentSymbolParams(text_document=document(uri))
    found = one.ask(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL, params)
    assert [(each.name, [child.name for child in each.children]) for each in found] == [
        ("Request", ["wheels"]),
        ("Response", ["ok"]),
    ]
    found = one.ask(lsp.WORKSPACE_SYMBOL, lsp.WorkspaceSymbolParams(query="wel"))
    assert [(each.name, each.container_name) for each in found] == [("Wheel", "demo")]


def test_layout_is_that_of_the_command_line(opened):
    one, uri, _ = opened
    one.change(uri, "int8   a\n\n\n\n\nint8 b# x\n")
    options = lsp.FormattingOptions(tab_size=4, insert_spaces=True)
    params = lsp.DocumentFormattingParams(text_document=document(uri), options=options)
    found = one.ask(lsp.TEXT_DOCUMENT_FORMATTING, params)
    assert [(each.range, each.new_text) for each in found] == [
        (lsp.Range(start=at(0, 0), end=at(1, 0)), "int8 a\n"),
        (lsp.Range(start=at(3, 0), end=at(6, 0)), "int8 b  # x\n"),
    ]
    params = lsp.DocumentRangeFormattingParams(
        text_document=document(uri), options=options, range=between(0, 0, 3)
    )
    assert one.ask(lsp.TEXT_DOCUMENT_RANGE_FORMATTING, params) == found[:1]
    params = lsp.DocumentOnTypeFormattingParams(
        text_document=document(uri), options=options, position=at(1, 0), ch="\n"
    )
    assert one.ask(lsp.TEXT_DOCUMENT_ON_TYPE_FORMATTING, params) == found[:1]
    one.change(uri, "int8   a\nint9 b\n---\n", 3)
    params = lsp.DocumentFormattingParams(text_document=document(uri), options=options)
    assert one.ask(lsp.TEXT_DOCUMENT_FORMATTING, params) == ()  # errors: it is left alone


def test_built_in_types_lead_to_their_documentation(opened):
    one, uri, _ = opened
    one.change(uri, "shape_msgs/Plane plane\nWheel wheel\n")
    text, _ = hover(opened, 0, 0)
    assert "(https://docs.ros.org/en/jazzy/p/shape_msgs/)" in text
    text, _ = hover(opened, 1, 0)
    assert "docs.ros.org" not in text
