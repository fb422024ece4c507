"""Entering a node in its package: the files that a node needs beside it, and those that list it.

Everything is a function of the texts of the package's files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from idlc.scaffold import new_package, node_tests
from idlc.scaffold.edits import console_script, data_files, launch_py, package_xml
from idlc.scaffold.edits.outcome import Edited, Outcome, Script
from idlc.scaffold.node import MAIN_MODULE
from idlc.scaffold.planned import Plan
from idlc.scaffold.templates import Templates

MANIFEST = "package.xml"
SETUP = "setup.py"
CONFTEST = "test/conftest.py"
LAUNCH_ENDING = "launch.py"


class Entry(NamedTuple):
    """What entering a node makes of a package: files to add, files to edit, things to do by hand.

    `notes` name the file that each is about.
    """

    added: Mapping[str, str]
    edits: Mapping[str, Outcome]
    notes: tuple[tuple[str, str], ...] = ()


def paths(package: str, launch_files: Iterable[str]) -> list[str]:
    """Return the files of a package whose texts decide; `launch_files` are names in `launch/`."""
    return [
        *("pyproject.toml", "setup.cfg", SETUP, MANIFEST, CONFTEST),
        *(f"{package}/__init__.py", _main_module(package), _launch_file(package, launch_files)),
    ]


def enter(
    planned: Plan,
    texts: Mapping[str, str],
    files: Mapping[str, str],
    templates: Templates,
    *,
    keys: Iterable[str] = (),
    folders: Mapping[str, bool] = MappingProxyType({}),
) -> Entry:
    """Return how a node, whose own files are `files`, is entered, but for the launch file.

    `texts` are those of the package's files that exist. A package with interfaces,
    whose `keys` are as `kind/Name.kind`, installs them; `folders` are its folders by dotted name.
    """
    node = planned.node
    script = Script(node.name, f"{node.package}.{node.name}:main")
    described = {one: texts[one] for one in ("pyproject.toml", "setup.cfg", SETUP) if one in texts}
    if (own := tuple(keys)) and SETUP in described:
        text = described[SETUP]
        described[SETUP] = data_files.add_interfaces(text, node.package, own, folders)
    path, outcome = console_script.add_script(described, script)
    tests = node_tests.packages(planned)
    manifest = package_xml.add(texts.get(MANIFEST, ""), depends=planned.packages, tests=tests)
    support = _support(node.package, texts, files, templates)
    return Entry(support, {path: outcome, MANIFEST: manifest})


def launch(planned: Plan, texts: Mapping[str, str], entry: Entry, templates: Templates) -> Entry:
    """Return an entry that lists the node in the launch file, too, which may be new.

    A node that does one thing and ends is for the command line.
    """
    if planned.once:
        return entry
    node = planned.node
    manifest = entry.edits.get(MANIFEST)
    if isinstance(manifest, Edited):  # what launch files import
        needed = package_xml.add(manifest.text, executes=("launch", "launch_ros"))
        entry = entry._replace(edits={**entry.edits, MANIFEST: needed})
    started = launch_py.Started(node.package, node.name, node.lifecycle)
    path = next((one for one in texts if one.startswith("launch/")), "")
    if path:
        outcome = launch_py.add_node(texts[path], started)
        return _launched(entry, path, outcome)
    path = _launch_file(node.package, ())
    plain = new_package.plain(node.package)
    text = new_package.rendered("package/launch.py.jinja", plain, templates)
    outcome = launch_py.add_node(text, started)
    if not isinstance(outcome, Edited):
        return _launched(entry, path, outcome)._replace(added={**entry.added, path: text})
    edits = dict(entry.edits)
    before = edits.get(SETUP, Edited(texts.get(SETUP, "")))
    if SETUP in texts and isinstance(before, Edited):
        edits[SETUP] = data_files.add_launch(before.text, node.package, path)
    return entry._replace(added={**entry.added, path: outcome.text}, edits=edits)


def _launched(entry: Entry, path: str, outcome: Outcome) -> Entry:
    """Return an entry with the edited launch file, or with what to do by hand."""
    if isinstance(outcome, Edited):
        return entry._replace(edits={**entry.edits, path: outcome})
    text = f"is not edited: {outcome.why}; add this {outcome.where}: {outcome.line.rstrip(',')}"
    return entry._replace(notes=(*entry.notes, (path, text)))


def _support(
    package: str, texts: Mapping[str, str], files: Mapping[str, str], templates: Templates
) -> dict[str, str]:
    """Return the files that nodes need beside them and that their package lacks."""
    plain = new_package.plain(package)
    found = {}
    if CONFTEST not in texts:
        found[CONFTEST] = new_package.rendered("package/conftest.py.jinja", plain, templates)
    if f"{package}/__init__.py" not in texts:
        found[f"{package}/__init__.py"] = ""
    module = _main_module(package)
    imported = any(f"{package}.{MAIN_MODULE} " in text for text in files.values())
    if imported and "def until_shutdown" not in texts.get(module, ""):
        found[module] = new_package.rendered("package/node_main.py.jinja", plain, templates)
    return found


def _main_module(package: str) -> str:
    return f"{package}/{MAIN_MODULE}.py"


def _launch_file(package: str, names: Iterable[str]) -> str:
    """Return the launch file that lists the package's nodes, of the names in `launch/`."""
    found = [name for name in names if name.endswith(LAUNCH_ENDING)]
    preferred = [f"{package}_launch.py", f"{package}.launch.py"]
    for name in (*preferred, *(found if len(found) == 1 else ())):
        if name in found:
            return f"launch/{name}"
    return f"launch/{preferred[0]}"
