"""Adding dependencies to a package.xml; every byte that is there stays."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

from idlc.project.edits import Edited, Outcome, Refused
from idlc.project.package_xml import DEPENDENCIES, RANK, Manifest, NotXmlError, read

#: Tags by which a package is there when a node runs.
AT_RUN_TIME = frozenset({"depend", "exec_depend", "run_depend"})
AT_TEST_TIME = AT_RUN_TIME | {"test_depend"}
GROUP = "rosidl_interface_packages"


def add(
    text: str,
    *,
    depends: Sequence[str] = (),
    executes: Sequence[str] = (),
    tests: Sequence[str] = (),
    group: bool = False,
) -> Outcome:
    """Return the file with the dependencies that it lacks.

    `depends` are needed to build and run, `executes` to run, `tests` for testing; with `group` the
    package says that it has interfaces.
    """
    data = text.encode("utf-8")
    manifest = _manifest(data)
    own = set(manifest.texts("name")) if manifest else set()
    if manifest is None or not own:
        line = " ".join(_depend(name, "depend") for name in depends)
        why = "it has no `<name>`" if manifest else "this is not a well-formed package.xml"
        return Refused(why, line, "within `<package>`")
    running = own.union(manifest.texts(*AT_RUN_TIME))
    testing = own.union(manifest.texts(*AT_TEST_TIME))
    tag = "run_depend" if manifest.format == "1" else "depend"
    new = [(tag, name) for name in depends if name not in running]
    execute = "run_depend" if manifest.format == "1" else "exec_depend"
    new += [(execute, name) for name in executes if name not in {*running, *depends}]
    testing.update(name for _, name in new)
    new += [("test_depend", name) for name in tests if name not in testing]
    if group and manifest.format not in ("1", "2"):
        present = manifest.texts("member_of_group")
        new += [("member_of_group", GROUP)] if GROUP not in present else []
    for kind, name in new:
        data = _with(data, kind, name)
    return Edited(data.decode("utf-8"))


def _manifest(data: bytes) -> Manifest | None:
    """Return what a package.xml says; `None` if it is not well-formed or another document."""
    try:
        manifest = read(data, "utf-8")
    except NotXmlError:
        return None
    return manifest if manifest.children else None


def _depend(name: str, tag: str) -> str:
    return f"<{tag}>{escape(name)}</{tag}>"


def _with(data: bytes, tag: str, name: str) -> bytes:
    """Return the file with an element, on a line of its own after its like."""
    elements = read(data, "utf-8").children
    same = [element for element in elements if element.tag == tag]
    before = same or [e for e in elements if RANK.get(e.tag, 99) < RANK[tag]]
    after = max(before, key=lambda element: element.end)
    line_start = data.rfind(b"\n", 0, after.start) + 1
    margin = data[line_start : after.start]
    if margin.strip():
        margin = b"  "
    ending = b"\r\n" if b"\r\n" in data else b"\n"
    gap = b"" if same or after.tag in DEPENDENCIES else ending
    at = _line_end(data, after.end)
    return data[:at] + ending + gap + margin + _depend(name, tag).encode() + data[at:]


def _line_end(data: bytes, at: int) -> int:
    """Return where a line ends that has nothing but a comment after `at`; `at` otherwise."""
    end = data.find(b"\n", at)
    end = len(data) if end < 0 else end
    rest = data[at:end].strip()
    if rest and not (rest.startswith(b"<!--") and rest.endswith(b"-->") and rest.count(b"<") == 1):
        return at
    return end - 1 if data[:end].endswith(b"\r") else end
