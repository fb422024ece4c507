"""Adding dependencies to a package.xml, which keeps every other byte."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from idlc.diagnostics.report import Edit, apply
from idlc.diagnostics.source import Source, Span
from idlc.packaging.outcome import Edited, Outcome, Refused
from idlc.project.package_xml import NOT_XML, Manifest, Statement, read, statements
from idlc.project.root import MANIFEST

#: The elements of a package.xml in the order of the schema: dependencies come after the head.
HEAD = ("name", "version", "description", "maintainer", "license", "url", "author")
DEPENDENCIES = (
    *("build_depend", "build_export_depend", "buildtool_depend", "buildtool_export_depend"),
    *("exec_depend", "run_depend", "depend", "doc_depend", "test_depend"),
    *("conflict", "replace", "group_depend", "member_of_group"),
)
RANK = {tag: at for at, tag in enumerate((*HEAD, *DEPENDENCIES))}
_BLANK_LINE = re.compile(r"[^\S\n]*\n[^\S\n]*\n")
#: Tags that make a package available when a node runs.
AT_RUN_TIME = frozenset({"depend", "exec_depend", "run_depend"})
AT_TEST_TIME = AT_RUN_TIME | {"test_depend"}
GROUP = "rosidl_interface_packages"


def add_dependencies(
    text: str,
    *,
    depends: Sequence[str] = (),
    executes: Sequence[str] = (),
    tests: Sequence[str] = (),
    group: bool = False,
) -> Outcome:
    """Return the file with the dependencies that it lacks.

    `depends` are needed to build and run, `executes` to run, `tests` for testing; `group` declares
    that the package has interfaces.
    """
    try:
        manifest = read(text.encode("utf-8"), "utf-8")
    except NOT_XML:
        manifest = Manifest("", ())
    own = set(manifest.texts("name"))
    if not own:
        lines = " ".join(f"<depend>{name}</depend>" for name in depends)
        why = "it has no `<name>`"
        if not manifest.elements:
            why = "this is not a well-formed package.xml"
        return Refused(why, lines, "within `<package>`")
    running = own.union(manifest.texts(*AT_RUN_TIME))
    testing = own.union(manifest.texts(*AT_TEST_TIME))
    old = ("run_depend", "run_depend")
    depend, execute = old if manifest.format == "1" else ("depend", "exec_depend")
    new = [(depend, name) for name in depends if name not in running]
    new += [(execute, name) for name in executes if name not in {*running, *depends}]
    testing.update(name for _, name in new)
    new += [("test_depend", name) for name in tests if name not in testing]
    if group and manifest.format not in ("1", "2"):
        present = manifest.texts("member_of_group")
        new += [("member_of_group", GROUP)] if GROUP not in present else []
    for kind, name in new:
        source = Source(MANIFEST, text)
        text = apply(text, addition(source, statements(source), kind, name))[0]
    return Edited(text)


def addition(
    manifest: Source, statements: Iterable[Statement], tag: str, name: str
) -> tuple[Edit, ...]:
    """Return the edits that add an element, on a line of its own after its like.

    An edit before it separates it from the head where blank lines separate groups of elements.
    """
    from html import escape  # with its thousands of names, of which few runs need three

    text = manifest.text
    ranked = [statement for statement in statements if RANK.get(statement.tag, 99) <= RANK[tag]]
    same = [statement for statement in ranked if statement.tag == tag]
    if not ranked:
        return ()
    after = max(same or ranked, key=lambda statement: statement.end)
    margin = text[text.rfind("\n", 0, after.span.start) + 1 : after.span.start]
    margin = "  " if margin.strip() else margin
    ending = "\r\n" if "\r\n" in text else "\n"
    # a comment on the line belongs to the element before it
    line = text[after.end :].partition("\n")[0].removesuffix("\r")
    is_comment = re.fullmatch(r"<!--[^<]*-->", line.strip()) is not None
    at = after.end + len(line) if is_comment or not line.strip() else after.end
    place = Span(manifest, at, at)
    element = Edit(place, f"{ending}{margin}<{tag}>{escape(name, quote=False)}</{tag}>")
    is_end = not same and after.tag not in DEPENDENCIES and _BLANK_LINE.match(text, at)
    return (Edit(place, ending), element) if is_end else (element,)
