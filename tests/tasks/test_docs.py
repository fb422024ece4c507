"""`idlc docs`: a site without dead links, that shows the text of files and runs none of it."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest

from idlc.cli.main import main
from idlc.tasks.docs_view import blocks
from tests.support.files import write

HOSTILE = '</p><script>alert(1)</script> "quoted" & <img src=x onerror=alert(1)>'
FILES = {
    "demo/msg/Drive.msg": "# How to drive.\n\nuint8 STOP=0  # halt\n"
    "float64 speed 0.5  # fast [m/s]\n"
    "geometry_msgs/Point[] points\nPart[<=2] parts\n",
    "demo/msg/Part.msg": f"# {HOSTILE}\n\nint8 number  # {HOSTILE} [<b>]\n"
    f"string TEXT='{HOSTILE.replace(chr(34), '')}'\n",
    "demo/srv/Ask.srv": "bool ok\n---\nDrive drive\nbool ok\n",
    "demo/action/Go.action": "---\n---\n",
}
VOID = {"meta", "link", "input", "img", "br", "wbr"}


class Page(HTMLParser):
    """Links, ids and elements of a page; fails on elements that do not close."""

    def __init__(self, text):
        super().__init__()
        self.links, self.ids, self.tags, self.open = [], [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.tags.append((tag, found))
        self.links += [found[key] for key in ("href", "src") if key in found]
        self.ids += [found["id"]] if "id" in found else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture
def site(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for path, text in FILES.items():
        write(path, text)
    assert main(["docs", "demo", "-o", "site"]) == 0
    return tmp_path / "site"


def read(site, path):
    return (site / path).read_text(encoding="utf-8")


def test_every_link_leads_somewhere_within_the_site(site):
    pages = {path: Page(read(site, path)) for path in site.rglob("*.html")}
    assert len(pages) > 6
    for path, page in pages.items():
        assert len(set(page.ids)) == len(page.ids), path
        for link in page.links:
            assert ":" not in link, link
            target, _, anchor = link.partition("#")
            there = (path.parent / target).resolve() if target else path
            assert there.is_file(), (path, link)
            assert not anchor or anchor in pages[there].ids


def test_what_is_searched_is_there(site):
    text = read(site, "index.js")
    index = json.loads(re.fullmatch(r"const INDEX = (.*);\n", text, re.DOTALL)[1])
    assert index[0][:2] == ["demo", "index.html"]
    names = [
        name + item for name, _, _, items in index for item in ["", *(one for one, _ in items)]
    ]
    assert {"demo/msg/Drive", "demo/msg/Drive.STOP", "demo/srv/Ask_Response.drive"} <= set(names)
    for _, path, _, items in index:
        assert {item[1:] for item, _ in items} <= set(Page(read(site, path)).ids)
    assert not any("<" in json.dumps(name) for name in names)


def test_a_page_says_what_there_is_to_say(site, capsys):
    text = read(site, "demo/msg-Drive.html")
    assert main(["show", "demo/msg/Drive.msg", "--format", "hash"]) == 0
    assert capsys.readouterr().out.split()[-2] in text
    for part in ("How to drive.", "STOP", "halt", ">m/s<", "0.5", "Part</a>[&lt;=2]", "Used by"):
        assert part in text
    assert 'href="../geometry_msgs/msg-Point.html"' in text
    assert "Empty." in read(site, "demo/action-Go.html")


def test_what_is_deprecated_is_struck_out(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write("demo/msg/Old.msg", "uint8 A=1  # deprecated: <b>\nuint8 b  # deprecated:\nuint8 c\n")
    assert main(["docs", "demo", "-o", "site"]) == 0
    text = read(Path("site"), "demo/msg-Old.html")
    assert re.findall(r'<code id="\w+">(.*?)</code>', text) == ["<s>A</s>", "<s>b</s>", "c"]
    capsys.readouterr()
    assert main(["show", "demo/msg/Old.msg", "--format", "jsonschema"]) == 0
    fields = json.loads(capsys.readouterr().out)["properties"]
    assert [name for name in fields if fields[name].get("deprecated")] == ["b"]


def test_text_of_files_stays_text(site):
    for path in site.rglob("*.html"):
        page = Page(read(site, path))
        scripts = [attrs for tag, attrs in page.tags if tag == "script"]
        assert len(scripts) == 1
        assert all("src" in attrs for attrs in scripts)
        assert not any(key.startswith("on") for _, attrs in page.tags for key in attrs)
        assert "img" not in {tag for tag, _ in page.tags}
    assert "&lt;script&gt;alert(1)" in read(site, "demo/msg-Part.html")


def test_control_characters_of_files_are_spelled_out(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bidi = "\u202e\u2066"
    write("odd/msg/Odd.msg", f"# red \x1b[31m and {bidi} \x7f\x9b\n\nint8 a  # \x1b]0;t\x07 b\n")
    write("odd/package.xml", f"<package><name>odd</name><license>{bidi}</license></package>")
    assert main(["docs", "odd", "-o", "site"]) == 0
    for path in filter(Path.is_file, Path("site").rglob("*")):
        text = path.read_text(encoding="utf-8")
        assert not set(text) & {"\x1b", "\x07", "\x7f", "\x9b", *bidi}, path
        assert "\\u001b" not in text
    page = read(Path("site"), "odd/msg-Odd.html")
    assert "red \N{SYMBOL FOR ESCAPE}[31m and &lt;U+202E&gt;" in page
    assert page.isprintable() or set(filter(lambda c: not c.isprintable(), page)) == {"\n"}


def test_the_title_page_tells_what_package_xml_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("demo/msg/Drive.msg", "# How to drive.\n\nint8 a\n")
    write(
        "demo/package.xml",
        "<package format='3'><name>demo_msgs</name><version>1.2.3</version>"
        "<description>Drives\n   <b>&amp;</b> stops.</description>"
        "<maintainer email='a@example.org'>Ann</maintainer><license>MIT</license></package>",
    )
    assert main(["docs", "demo", "-o", "site"]) == 0
    text = read(Path("site"), "index.html")
    assert "<h1>demo_<wbr>msgs</h1>" in text
    assert "Drives &amp; stops." in text
    assert "version 1.2.3 · maintained by Ann · licence MIT" in text


def test_several_packages_have_a_page_each(tmp_path, monkeypatch, capsys):
    """Five hundred interfaces are listed by package; what is searched comes when it is wanted."""
    monkeypatch.chdir(tmp_path)
    for number in range(500):
        package = f"part{number % 10}_msgs"
        about = f"<package><name>{package}</name><version>1.{number % 10}.0</version></package>"
        write(f"src/{package}/package.xml", about)
        fields = f"part{(number + 1) % 10}_msgs/Thing{(number + 1) % 500} next\n" * (number % 2)
        write(f"src/{package}/msg/Thing{number}.msg", f"# A thing.\n\nint8 a  # [m]\n{fields}")
    assert main(["docs", "src", "-o", "site"]) == 0
    assert capsys.readouterr().out.startswith("511 pages written")
    site = Path("site")
    front = Page(read(site, "index.html"))
    assert "part3_msgs/index.html" in front.links
    assert "version 1.3.0 · 50 messages" in read(site, "index.html")
    assert len(read(site, "index.html")) < 10_000
    own = Page(read(site, "part3_msgs/index.html"))
    assert sum(link.startswith("../part3_msgs/msg-Thing") for link in own.links) == 50
    page = read(site, "part3_msgs/msg-Thing13.html")
    assert '<a href="../part3_msgs/index.html">part3_msgs</a>' in page
    assert "version 1.3.0" in page
    assert '<a href="../part4_msgs/msg-Thing14.html"' in page
    assert "index.js" not in page


def test_known_packages_and_types_are_given_by_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write("demo/msg/Drive.msg", "trajectory_msgs/JointTrajectory path\n")
    assert main(["docs", "demo", "shape_msgs", "stereo_msgs/DisparityImage", "-o", "site"]) == 0
    listed = {path.parent.name for path in Path("site").glob("*/index.html")}
    assert listed == {"demo", "shape_msgs", "stereo_msgs"}
    assert "2 messages" not in read(Path("site"), "stereo_msgs/index.html")
    assert main(["docs", "shap_msgs", "-o", "other"]) == 2
    assert "shape_msgs" in capsys.readouterr().err
    assert not Path("other").exists()


def test_a_field_has_an_address(site):
    page = Page(read(site, "demo/srv-Ask.html"))
    assert {"#Request.ok", "#Response.ok"} <= set(page.links)
    assert {"Request.ok", "Response.ok"} <= set(page.ids)


def test_a_page_holds_the_text_of_its_file(site):
    page = read(site, "demo/msg-Drive.html")
    assert "<pre># How to drive.\n\nuint8 STOP=0  # halt\n" in page
    assert "<details>" in page


def test_only_what_is_drawn_is_kept_as_drawn():
    assert blocks(["-PI..+PI,  (radians)"])[0].tag == "p"
    assert blocks(["one  two"])[0].tag == "p", "one line is no drawing"
    assert blocks(["A sentence.  Another one,", "which goes on."])[0].tag == "p"
    assert blocks(["+--+  +--+", "|a |--|b |"])[0].tag == "pre"
    assert blocks(["A list:", "  - one"])[0].tag == "pre"


def test_pictures_are_well_formed(site):
    text = read(site, "demo/msg-Drive.html")
    picture = ElementTree.fromstring(re.search(r"<svg.*</svg>", text, re.DOTALL)[0])  # noqa: S314
    assert sorted(picture.itertext())[-4:] == ["Ask", "Drive", "Part", "geometry_msgs/Point"]
    assert float(picture.get("width")) > 100
    assert "<svg" not in read(site, "demo/action-Go.html")


def test_only_pages_of_an_earlier_run_are_replaced_or_removed(site, capsys):
    write("site/mine.txt", "mine")
    Path("demo/action/Go.action").unlink()
    assert main(["docs", "demo", "-o", "site"]) == 0
    assert not (site / "demo/action-Go.html").exists()
    assert read(site, "mine.txt") == "mine"
    write("other/index.html", "mine")
    assert main(["docs", "demo", "-o", "other"]) == 1
    assert "[IDL614]" in capsys.readouterr().err
    assert [path.name for path in Path("other").iterdir()] == ["index.html"]


def test_what_has_errors_is_left_out_and_the_rest_written(site, capsys):
    write("demo/msg/Wrong.msg", "flot64 a\n")
    write("demo/msg/Uses.msg", "Wrong[] a\n")
    assert main(["docs", "demo", "-o", "elsewhere"]) == 1
    said = capsys.readouterr().err
    assert "[IDL201]" in said
    assert (
        "idlc skipped these interfaces because of errors: `demo/msg/Uses`, `demo/msg/Wrong`" in said
    )
    pages = {path.name for path in Path("elsewhere").rglob("*.html")}
    assert pages == {path.name for path in site.rglob("*.html")}


@pytest.mark.parametrize(
    ("comments", "heading"),
    [("[m] [0..1]", "unit or range"), ("[m]", "unit"), ("[0..1]", "range")],
)
def test_a_range_is_no_unit(tmp_path, capsys, comments, heading):
    fields = "".join(f"float64 f{at}  # {text}\n" for at, text in enumerate(comments.split()))
    (tmp_path / "demo/msg").mkdir(parents=True)
    (tmp_path / "demo/msg/Drive.msg").write_text(fields)
    assert main(["docs", str(tmp_path / "demo"), "-o", str(tmp_path / "site")]) == 0
    pages = [one.read_text(encoding="utf-8") for one in (tmp_path / "site").rglob("*.html")]
    assert any(f'<th class="unit">{heading}</th>' in text for text in pages)
    capsys.readouterr()


def test_a_field_leads_to_its_constants(tmp_path):
    text = "uint8 MODE_OFF=0\nuint8 MODE_ON=1\nuint8 LAST_ONE=1\nuint8 mode\nuint8 last\n"
    write(tmp_path / "demo/srv/Switch.srv", f"{text}---\nuint8[] mode\n")
    assert main(["docs", str(tmp_path / "demo"), "-o", str(tmp_path / "site")]) == 0
    (page,) = (tmp_path / "site").rglob("srv-Switch.html")
    links = re.findall('<a href="#([^"]*)">constants</a>', page.read_text(encoding="utf-8"))
    assert links == ["Request.MODE_OFF"]
