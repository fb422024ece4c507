"""The documentation site in a real browser: nothing is cut off, and the search finds.

`make test BROWSER=no` leaves this file out.
"""

import json
import shutil
import sys
from pathlib import Path

import pytest

from tests.support import browser

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

QUESTIONS = tomllib.loads((Path(__file__).parent / "questions.toml").read_text(encoding="utf-8"))[
    "asked"
]
#: How many results somebody looks at.
FIRST = 5
DESK, PHONE = 1280, 360
MEASURE = """
// What reaches over the window, unless it is in something that scrolls.
export function measure(window, width) {
  const page = window.document;
  const kinds = ["auto", "scroll", "hidden"];
  const scrolls = (one) => kinds.includes(window.getComputedStyle(one).overflowX);
  const inside = (one) => {
    for (let around = one.parentElement; around !== page.body; around = around.parentElement) {
      if (scrolls(around) && around.getBoundingClientRect().right <= width + 0.5) return true;
    }
    return false;
  };
  const over = [...page.querySelectorAll(".md-content *, .md-header *, .md-footer *")]
    .filter((one) => one.checkVisibility() && one.getBoundingClientRect().right > width + 0.5)
    .filter((one) => !inside(one))
    .map((one) => `${one.tagName} ${one.textContent.slice(0, 60)}`);
  const hosts = window.performance.getEntriesByType("resource")
    .map((one) => new URL(one.name).host).filter((host) => host !== window.location.host);
  const colours = window.getComputedStyle(page.body);
  return { client: page.documentElement.clientWidth, scroll: page.documentElement.scrollWidth,
    over, hosts, back: colours.backgroundColor, text: colours.color,
    pictures: [...page.images].filter((one) => one.naturalWidth === 0).map((one) => one.src) };
}
"""
SEARCH = r"""
const sleep = (time) => new Promise((ready) => setTimeout(ready, time));
const until = async (found, what) => {
  for (let count = 0; count < 1500; count += 1) {
    const one = found();
    if (one) return one;
    await sleep(10);
  }
  throw new Error(`no ${what ?? found}`);
};
const QUESTIONS = %s;

export async function measure(window) {
  const page = window.document;
  const button = await until(() => page.querySelector(".md-search button, label[for=__search]"));
  button.click();
  const host = await until(() => [...page.querySelectorAll("div")].find((one) => one.shadowRoot));
  const input = await until(() => host.shadowRoot.querySelector("input"));
  const search = window.Worker.prototype;
  const { deliver } = search;
  let told;
  search.deliver = function () {
    told = [this.asked.data.input, this.items[this.found.items[0]?.id]?.location];
    deliver.call(this);
  };
  const place = ({ href }) => href.replace(/^.*\/site\//, "").replace(/\?[^#]*/, "");
  const answers = {};
  for (const question of QUESTIONS) {
    input.value = question;
    input.dispatchEvent(new window.Event("input", { bubbles: true }));
    await until(() => told?.[0] === question, `answer to ${question}, but to ${told}`);
    const links = () => [...host.shadowRoot.querySelectorAll("ol a[href]")];
    const first = told[1] && place({ href: told[1] });
    await until(() => !first || (links()[0] && place(links()[0]) === first), `results: ${told}`);
    answers[question] = told[1] ? links().map(place) : [];
  }
  return { answers };
}
"""


@pytest.fixture(scope="module")
def documents(site):
    """Return the pages that are looked at: all but the rules, of which a few stand for all."""
    pages = [*site.glob("*.html"), *(site / "contributing").glob("*.html")]
    pages += [site / "rules" / f"{name}.html" for name in ("index", "IDL201", "IDL455", "IDL530")]
    return sorted(path.relative_to(site).as_posix() for path in pages)


@pytest.fixture(scope="module")
def light(site, documents):
    return browser.measured(site, documents, [DESK, PHONE], MEASURE)


@pytest.fixture(scope="module")
def dark(site):
    return browser.measured(site, ["index.html", "language.html"], [PHONE], MEASURE, dark=True)


def test_nothing_is_wider_than_the_window(light, dark):
    assert len(light) > 60
    for one in [*light, *dark]:
        assert one["client"] == one["width"]
        assert one["scroll"] <= one["client"], one
        assert one["over"] == [], (one["page"], one["width"])


@pytest.mark.long
@pytest.mark.parametrize("pattern", ["*", "contributing/*", "rules/*", "interfaces/**/*"])
def test_no_page_is_wider_than_a_phone(site, pattern):
    pages = sorted(path.relative_to(site).as_posix() for path in site.glob(f"{pattern}.html"))
    assert len(pages) > 4
    for page in browser.measured(site, pages, [PHONE], MEASURE):
        assert page["scroll"] <= page["client"] == PHONE, page
        assert page["over"] == [], page["page"]


def test_all_pictures_are_shown_and_nothing_comes_from_elsewhere(light):
    for one in light:
        assert one["pictures"] == [], one["page"]
        assert one["hosts"] == [], one["page"]


def test_pages_are_dark_for_who_wants_them_dark(light, dark):
    for one in dark:
        (bright,) = [
            other for other in light if (other["page"], other["width"]) == (one["page"], PHONE)
        ]
        assert brightness(bright["back"]) > 200 > 100 > brightness(bright["text"])
        assert brightness(one["back"]) < 60 < 150 < brightness(one["text"])


def brightness(colour: str) -> float:
    """Return how bright a colour is, as `rgb(…)` or `rgba(…)` names it; 255 is white."""
    return sum(map(float, colour.partition("(")[2].rstrip(")").split(",")[:3])) / 3


# the search


def test_the_search_finds_the_page_with_the_answer(site):
    (found,) = browser.measured(site, ["index.html"], [DESK], SEARCH % json.dumps([*QUESTIONS]))
    missed = {}
    for question, pages in QUESTIONS.items():
        first = found["answers"][question][:FIRST]
        if not {*first, *(one.partition("#")[0] for one in first)} & {*pages}:
            missed[question] = first
    assert len(QUESTIONS) > 30
    assert missed == {}


def test_the_search_works_on_a_folder(site, tmp_path):
    """Pages that were opened as files find as much, without a server."""
    copy = shutil.copytree(site, tmp_path / "site")
    script = SEARCH % '["can I record my topic"]'
    script = script.replace("export async", "async") + (
        "measure(window).then(({ answers }) => {"
        "document.body.replaceChildren(JSON.stringify(answers)); });"
    )
    page = copy / "index.html"
    text = page.read_text(encoding="utf-8")
    page.write_text(text.replace("</body>", f"<script>{script}</script></body>"), encoding="utf-8")
    assert "ros-tools.html" in browser.dumped(page)
