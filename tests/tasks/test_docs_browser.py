"""`idlc docs` as a browser lays it out: nothing is cut off, at the widths of desk and phone.

`make test BROWSER=no` leaves this file out.
"""

from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support import browser

WIDTHS = [1280, 500, 360]
URL = "https://example.org/" + "a-long-path/" * 20
LONG = "a_name_of_many_words_" * 9 + "end"
TYPE = "VeryLongNameOfAMessageThatSomebodyThoughtOfOnAFridayAfternoon" * 2
DRAWN = "# +-----------+   " + "-" * 150 + ">  away\n#   |  box  |\n"
FILES = {
    f"msg/{TYPE}.msg": f"# {URL}\n{DRAWN}float64 x\n",
    "msg/Table.msg": f"# {'W' * 400}\n\n{DRAWN}\n# see {URL} for more\n\n"
    f"string NAME='{'x' * 300}'  # {URL}\n"
    f"uint64 {LONG.upper()}=18446744073709551615\n"
    f"float64 {LONG}\n"
    f"{TYPE}[<=4] several\n"
    f"{TYPE}[17] {LONG}_too\n"
    f"int32[] numbers [{', '.join(map(str, range(1000, 1100)))}]\n"
    f'string<=500 text "{"y" * 400}"  # {"z" * 300} [{"m" * 90}]\n'
    f"float32 heading  # [rad] -PI..+PI,  (radians)\n{DRAWN}float32 drawn\n"
    "float32 plain # a sentence.  Another one, which goes on until it fills some more lines. [m]\n"
    "string[] strings\n",
    "msg/Local.msg": "# Fused local position in NED.\n# The coordinate system origin is where the"
    " vehicle was when the estimator started.\n\nuint32 MESSAGE_VERSION = 0\n\n"
    "uint64 timestamp # time since system start (microseconds)\n"
    "uint64 timestamp_sample # the timestamp of the raw data (microseconds)\n"
    "bool xy_valid # true if x and y are valid\n"
    "float32 x # North position in NED earth-fixed frame, (metres)\n"
    "float32 heading # Euler yaw angle of the body relative to NED, -PI..+PI,  (radians)\n"
    "float32[2] delta_xy # (metres)\nfloat32 hagl_max_z # [m] maximum height above ground\n",
    "srv/Ask.srv": f"# {'N' * 300}\nfloat64 {LONG}\n---\n{TYPE} {LONG}\n",
    "action/Go.action": f"Table table\n---\n# {URL}\nbool ok\n---\nfloat64 part 0.25  # [%]\n",
    "package.xml": '<package format="3"><name>hostile</name><version>1.2.3</version>'
    f"<description>{'D' * 200} {URL}</description><maintainer email='a@b.c'>{'M' * 90}</maintainer>"
    f"<license>{'L' * 90}</license></package>",
}
MEASURE = """
const seen = (cell) => cell.checkVisibility() && cell.textContent.trim() !== "";

export function measure(window, width) {
  const page = window.document;
  page.querySelectorAll("details").forEach((one) => { one.open = true; });
  const root = page.documentElement;
  const over = [...page.querySelectorAll("main *, header *")]
    .filter((one) => !one.closest("svg") && one.querySelector("svg") === null)
    .filter((one) => one.scrollWidth > one.clientWidth + 1 && one.clientWidth > 0
      || one.getBoundingClientRect().right > width + 0.5)
    .map((one) => `${one.tagName} ${one.textContent.slice(0, 40)}`);
  const meanings = [...page.querySelectorAll("td.meaning")].filter(seen)
    .map((one) => one.clientWidth);
  const fonts = [...page.querySelectorAll("td .type, td .type *, td.type *")]
    .map((one) => window.getComputedStyle(one).fontFamily);
  return { scroll: root.scrollWidth, client: root.clientWidth, over,
    meaning: Math.min(...meanings, width), fonts: [...new Set(fonts)],
    type: page.querySelector("h1").textContent };
}
"""
SEARCH = """
export async function measure(window) {
  const field = window.document.getElementById("search");
  field.dispatchEvent(new window.Event("focus"));
  const script = window.document.querySelector("script[src$='index.js']");
  await new Promise((ready) => { script.addEventListener("load", ready); });
  const answer = {};
  for (const words of ["batery volt", "heading", "euler yaw", "table", ""]) {
    field.value = words;
    field.dispatchEvent(new window.Event("input"));
    const found = window.document.getElementById("found");
    answer[words] = found.checkVisibility() ? found.innerText : "";
  }
  return { answer };
}
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    for path, text in FILES.items():
        (folder / "hostile" / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / "hostile" / path).write_text(text, encoding="utf-8")
    assert main(["docs", str(folder / "hostile"), "-o", str(folder / "site")]) == 0
    return folder / "site"


def pages(site: Path) -> list[str]:
    return sorted(path.relative_to(site).as_posix() for path in site.rglob("*.html"))


@pytest.fixture(scope="module")
def measured(site):
    found = browser.measured(site, pages(site), WIDTHS, MEASURE)
    assert len(found) == len(pages(site)) * len(WIDTHS)
    return found


def test_nothing_is_wider_than_the_window(measured):
    for one in measured:
        assert one["client"] == one["width"], "a frame of that width"
        assert one["scroll"] <= one["client"], one
        assert one["over"] == [], one


def test_the_meaning_of_a_field_can_be_read(measured):
    for one in measured:
        assert one["meaning"] >= min(300, one["width"] * 0.75), one


def test_types_are_set_in_one_font(measured):
    assert len({font for one in measured for font in one["fonts"]}) == 1


def test_a_search_says_what_it_found_and_that_it_found_nothing(site):
    (found,) = browser.measured(site, ["index.html"], [1280], SEARCH)
    answer = found["answer"]
    assert "nothing" in answer["batery volt"].lower()
    assert answer["heading"].startswith("hostile/msg/Local.heading")
    assert "hostile/msg/Local.heading" in answer["euler yaw"], "words of a comment"
    assert answer["table"].startswith("hostile/msg/Table")
    assert answer[""] == ""
