"""Documents, rules, templates, pictures and an example of `idlc docs` → the site."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from maintenance.website import (
    colours,
    dialect,
    interfaces,
    landing,
    playground,
    rules,
    sources,
    templates,
)

HERE = Path(__file__).parent
#: The head of a page that the search leaves out.
NOT_SEARCHED = b"---\nsearch:\n  exclude: true\n---\n\n"


def build(out: Path) -> None:
    """Write the site into `out`, where only another one is replaced; any warning ends it."""
    if out.exists() and any(out.iterdir()) and not (out / "search.json").is_file():
        raise SystemExit(f"{out} holds something else than a site: name another folder")
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        files = {**sources.files(), **rules.pages()}
        for place in sources.unsearched(files):
            files[place] = NOT_SEARCHED + files[place]
        added = {landing.PLACE: landing.page(), templates.PLACE: NOT_SEARCHED + templates.page()}
        _write(work / "docs", {**files, **added})
        shutil.copytree(HERE / "assets", work / "docs" / "assets")
        shutil.copytree(HERE / "theme", work / "theme")
        interfaces.write(work / "docs")
        config = (HERE / "zensical.toml").read_text(encoding="utf-8")
        nav = _navigation(files)
        config = config.replace("nav = []", f"nav = {nav}", 1)
        (work / "zensical.toml").write_text(config, encoding="utf-8")
        done = subprocess.run(
            [sys.executable, "-m", "zensical", "build", "--strict"],
            cwd=work,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise SystemExit(f"{done.stdout}{done.stderr}")
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(work / "site", out)


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    for place, data in files.items():
        path = folder / place
        path.parent.mkdir(parents=True, exist_ok=True)
        if place.endswith(".md"):
            text = playground.with_links(place, data.decode("utf-8"))
            data = dialect.translated(colours.with_colours(text)).encode("utf-8")
        path.write_bytes(data)


def _navigation(files: Mapping[str, bytes]) -> str:
    """Return the navigation as a value in TOML: the sections of docs/index.md, and more."""
    sections = [("Home", landing.PLACE), ("All pages", sources.place(sources.START))]
    sections += sources.navigation(files)
    look_up = dict(sections)["Reference"]
    look_up.append(("Playground", playground.PLACE))
    look_up.append(("The interfaces of ROS 2", f"{interfaces.PLACE}/index.md"))
    dict(sections)["Contributing"].append(("Templates", templates.PLACE))
    return _list(sections)


def _list(entries: Sequence[tuple[str, Any]]) -> str:
    values = (
        f"{json.dumps(title)} = {json.dumps(to) if isinstance(to, str) else _list(to)}"
        for title, to in entries
    )
    return f"[{', '.join(f'{{{value}}}' for value in values)}]"
