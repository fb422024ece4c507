"""The documentation site: complete, without a dead link, and without anything of another host."""

import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import parse_qs, unquote

import pytest

from idlc.diagnostics.codes import CODES
from maintenance.website import colours, sources, templates
from maintenance.website.build import build
from maintenance.website.dialect import translated
from tests.support.paths import DOCS, GOLDEN, ROOT

#: Elements that load what they name.
LOADS = {"script", "link", "img", "iframe", "source", "video", "object", "embed"}
PLAYGROUND = "playground/index.html"
CODE = {"pre", "code", "script", "style"}


class Page(HTMLParser):
    """What a page links to and loads, what can be linked to, and its text outside of code."""

    def __init__(self, path):
        super().__init__()
        self.links, self.loads, self.ids, self.text, self.depth = [], [], set(), "", 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        links = [found[key] for key in ("href", "src", "data", "srcset") if found.get(key)]
        (self.loads if tag in LOADS else self.links).extend(links)
        self.ids |= {found[key] for key in ("id", "name") if found.get(key)}
        self.depth += tag in CODE

    def handle_endtag(self, tag):
        self.depth -= tag in CODE

    def handle_data(self, data):
        self.text += "" if self.depth else data


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path) for path in site.rglob("*.html") if path.name != "404.html"}


def test_each_template_is_shown_with_what_it_writes(site):
    page = (site / templates.PLACE).with_suffix(".html").read_text(encoding="utf-8")
    shown = re.findall(r"(?s)<h3 id=[^>]*>([^<]*)<.*?<code", page)
    assert shown == templates.names()


def test_every_link_leads_somewhere(site, pages):
    ids = cache(lambda path: pages[path].ids if path in pages else set())
    dead = []
    for path, page in pages.items():
        for link in {*page.links, *page.loads}:
            if re.match(r"https?:|mailto:", link) or PLAYGROUND in link:
                continue  # `make playground` writes the last
            target, _, anchor = unquote(link).partition("#")
            there = (path.parent / target).resolve() if target else path
            if not there.is_file() or (anchor and anchor not in ids(there)):
                dead.append((path.relative_to(site).as_posix(), link))
    assert dead == []


def test_nothing_is_loaded_from_another_host(site, pages):
    for path, page in pages.items():
        assert not [link for link in page.loads if re.match(r"\w+:|//", link)], path
    for path in site.rglob("*.css"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"@import|url\(\s*['\"]?(\w+:(?<!data:)|//)", text), path


def test_blocks_of_interfaces_open_in_the_playground(site, pages):
    links = {
        code: [
            link for link in pages[site / f"rules/{code}.html"].links if f"{PLAYGROUND}#" in link
        ]
        for code in ("IDL201", "IDL504")
    }
    bad, good = links["IDL201"]
    assert bad == "../playground/index.html#msg/Example?text=flot64%20ranges%0A"
    assert good.endswith("text=float64%20ranges%0A")
    assert any(
        f"{PLAYGROUND}#msg/Drive" in link for link in pages[site / "first-message.html"].links
    )
    values = parse_qs(links["IDL504"][0].partition("?")[2])
    assert values == {"text": ["float64 velocity\n"], "before": ["float64 speed\n"]}


def test_every_document_has_a_page(site, pages):
    for document in DOCS.rglob("*.md"):
        place = sources.place(document.relative_to(ROOT).as_posix())
        assert (site / place).with_suffix(".html") in pages, document
    for code in CODES:
        assert f"idlc explain {code}" in (site / "rules" / f"{code}.html").read_text("utf-8")


def test_no_markdown_is_left(pages):
    for path, page in pages.items():
        left = re.findall(r"```.*|\]\([^)]*\)|\*\*\w.*", page.text)
        assert left == [], path


def test_pages_are_reached_from_the_navigation(site, pages):
    start = site / "index.html"
    linked = {(start.parent / link.partition("#")[0]).resolve() for link in pages[start].links}
    text = pages[start].text
    assert all(title in text for title in ("Tutorials", "Guides", "Reference", "Concepts"))
    named = [there for _, part in sources.navigation(sources.files()) for _, there in part]
    assert len(named) > 25
    assert {(site / there).with_suffix(".html") for there in named} <= linked


def test_the_landing_page_shows_parts_of_the_readme(site, pages):
    text = (site / "index.html").read_text(encoding="utf-8")
    assert "{{" not in text
    assert {"pictures/first.svg", "pictures/speed.svg"} <= set(pages[site / "index.html"].loads)
    for words in ("idlc-env", "create_node", '<span class="kt">float64</span>'):
        assert words in text
    assert PLAYGROUND in pages[site / "index.html"].links


def test_pages_of_interfaces_are_pages_of_the_site(site, pages):
    page = site / "interfaces/sensor_msgs/msg-Imu.html"
    start, packages, package = "../../index.html", "../index.html", "../sensor_msgs/index.html"
    assert {start, packages, package} <= set(pages[page].links)
    text = page.read_text(encoding="utf-8")
    assert 'id="angular_velocity"' in text
    assert '<span class="kt">float64</span>' in text
    assert "<title>sensor_msgs/msg/Imu - idlc</title>" in text


def test_only_a_site_is_replaced(tmp_path):
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(SystemExit, match="something else"):
        build(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


# the colours


def test_colours_leave_the_text_as_it_is():
    files = sorted((GOLDEN / "rosidl").rglob("*.msg"))
    assert len(files) > 10
    for path in files:
        for line in path.read_text(encoding="utf-8").splitlines():
            assert "".join(text for text, _ in colours.tokens(line)) == line


def test_colours_are_those_of_the_grammar(site):
    scopes = dict(colours.tokens("std_msgs/Header[<=3] header  # where [m]"))
    assert scopes["Header"] == "entity.name.type.rosmsg"
    assert scopes["header"] == "variable.other.member.rosmsg"
    assert scopes["[m]"] == "constant.other.unit.rosmsg"
    page = (site / "rules/IDL201.html").read_text(encoding="utf-8")
    assert '<span class="kt">float64</span> <span class="n">ranges</span>' in page


# the dialect


def test_a_block_of_code_has_the_name_of_its_file_as_title():
    text = "```msg/Drive.msg\nint8 a\n```\n\n```pyproject.toml\n[a]\n```\n\n```sh\nls\n```\n"
    assert re.findall("(?m)^```(.+)$", translated(text)) == [
        ' text title="msg/Drive.msg"',
        ' toml title="pyproject.toml"',
        "sh",
    ]


def test_what_stands_in_a_list_is_indented_by_four():
    text = "text:\n* one\n\n  ```py\n  a:\n    b\n  ```\n\n  more\n"
    text += "1. two\n   1. three\n\n      end\nout\n"
    assert translated(text) == (
        "text:\n\n* one\n\n    ```py\n    a:\n      b\n    ```\n\n    more\n"
        "1. two\n    1. three\n\n        end\nout\n"
    )


@pytest.mark.parametrize(
    "text",
    [
        "a\n\n    code\n    * no list\n\nb\n",
        "```sh\n* no list\n  1. nor this\n```\n",
        "````markdown\n```msg/A.msg\n* x\n```\n````\n",
        "- - -\n",
    ],
)
def test_what_is_no_list_stays(text):
    assert translated(text) == text


@pytest.mark.parametrize(
    ("link", "moved"),
    [
        ("ci.md", "../ci.md"),
        ("../README.md#try-it", "../about.md#try-it"),
        ("../action.yml", "../files/action.yml"),
        ("../idlc/diagnostics/explain", "../rules/index.md"),
        ("../idlc/diagnostics/explain/IDL405.md", "../rules/IDL405.md"),
        ("pictures/check.svg", "../pictures/check.svg"),
        ("https://docs.ros.org", "https://docs.ros.org"),
        ("#here", "#here"),
    ],
)
def test_links_hold_where_the_page_is(link, moved):
    deeper = link if link[0] == "#" or ":" in link else f"../{link}"
    path = Path("docs/contributing/style.md").as_posix()
    code = f"`[a]({deeper})`\n\n   ```sh\n   [a]({deeper})\n   ```\n"
    assert sources.moved(path, f"[a]({deeper}) {code}") == f"[a]({moved}) {code}"
