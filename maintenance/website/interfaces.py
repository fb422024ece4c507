"""The pages of `idlc docs` for the standard interfaces, in the frame of the site."""

from __future__ import annotations

import json
import re
import sys
import tempfile
from contextlib import redirect_stdout
from html import unescape
from io import StringIO
from pathlib import Path

from idlc.cli.main import main
from maintenance.website.colours import block

PLACE = "interfaces"
PACKAGES = """
    actionlib_msgs diagnostic_msgs geometry_msgs nav_msgs sensor_msgs shape_msgs std_msgs std_srvs
    stereo_msgs trajectory_msgs visualization_msgs
""".split()
_PAGE = re.compile(r"(?s)<title>(.*?)</title>.*<main>\n(.*)</main>")
_SOURCE = re.compile(r"(?s)(?<=</summary>\n)<pre>(.*?)</pre>")
_HOME = '<p class="path"><a href="../index.html">Interfaces</a>'


def write(docs: Path) -> None:
    """Write a page for each interface of common_interfaces, and a style sheet, into `docs`."""
    share = Path(sys.prefix) / "share"
    installed = {name for name in PACKAGES if (share / name / "package.xml").is_file()}
    words = [str(share / name) if name in installed else name for name in PACKAGES]
    with tempfile.TemporaryDirectory() as folder:
        with redirect_stdout(StringIO()):  # it names the temporary folder
            failed = main(["docs", *words, "-o", folder])
        if failed:
            raise SystemExit("idlc docs failed, see above")
        for path in Path(folder).rglob("*.html"):
            page = docs / PLACE / path.relative_to(folder).with_suffix(".md")
            page.parent.mkdir(parents=True, exist_ok=True)
            page.write_text(_page(path.read_text(encoding="utf-8")), encoding="utf-8")
        style = (Path(folder) / "style.css").read_text(encoding="utf-8")
    # the theme's rem is another: these pages use the size of their text
    style = f".interfaces {{\n{style.replace('rem', 'em')}}}\n"
    (docs / "assets/interfaces.css").write_text(style, encoding="utf-8")


def _page(text: str) -> str:
    """Return a page of `idlc docs` as HTML in Markdown, which gets the frame of the site."""
    match = _PAGE.search(text)
    assert match is not None
    title, content = unescape(match[1]), match[2]
    if content.startswith('<p class="path">'):
        content = content.replace('<p class="path">', f"{_HOME} / ", 1)
    elif title != "Interfaces":
        content = f"{_HOME}</p>\n{content}"
    content = content.replace("<table>", '<table class="items">')
    content = _SOURCE.sub(lambda source: block(unescape(source[1])), content)
    head = json.dumps({"title": title, "hide": ["toc"]})
    return f'---\n{head}\n---\n\n<div class="interfaces">\n{content}</div>\n'
