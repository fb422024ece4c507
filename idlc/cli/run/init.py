"""`idlc init`: planning, showing, writing and proving."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import click

from idlc.cli import options, output
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError
from idlc.diagnostics.terminal import counted
from idlc.diagnostics.text import one_line, printable
from idlc.generate.package import Generated
from idlc.packaging.files import SETUP_PY
from idlc.project.find import list_files
from idlc.project.root import Root
from idlc.project.settings import load_settings, scope
from idlc.scaffold import init
from idlc.scaffold.changes import ScaffoldOptions
from idlc.scaffold.layouts import Layout, layout_of
from idlc.scaffold.proof import Proof, installed_files, prove

TEST = "The test runs the package's own build."


CONSENT = f"Write these changes, compile and test? {TEST}"


def run(path: str, service: str | None, yes: bool) -> int:
    """Run the command and return the exit status."""
    try:
        root = Root.at(Path(path))
    except (OSError, ValueError) as error:
        raise click.UsageError(f"no such folder: {path!r}") from error
    path = f"./{path}" if path.startswith("-") else path  # for the commands to paste
    report = Report()
    try:
        layout = layout_of(root, report)
    except ReportedError:
        output.show(report, "text", sys.stderr)
        sys.stderr.write("nothing was written\n")
        return output.status(report)
    planned, status = _plans(layout, root, report)
    extras: list[tuple[init.Draft, list[str]]] = []
    if service:
        others = Report()
        with suppress(ReportedError):
            checks = init.continuous(service, layout, others)
            extras.append((checks, init.obtaining(checks)))
        output.show(others, "text", sys.stderr)
        status = max(status, output.status(others))
    if planned:
        extras.append((init.recommendation(root, report), []))
    drafts = [(each.draft, each.out) for each in planned] + [(draft, "") for draft, _ in extras]
    for draft, out in drafts:
        _show(draft, out, root)
    is_changed = any(draft.reasons for draft, _ in drafts)
    if is_changed and not yes and not _consents(path):
        return max(status, 1)
    for draft, commands in extras:
        status = max(status, _write(draft, commands))
    for preparation in planned:
        status = max(status, _finish(preparation, root, again=yes))
    if not is_changed and not status:
        sys.stdout.write("nothing to do\n")
    if planned and not status:
        _show_next(path, layout, planned)
    return status


def _consents(path: str) -> bool:
    """Return whether the user agrees to the changes; without a terminal, name the option."""
    if sys.stdin.isatty() and sys.stdout.isatty():
        return click.confirm(CONSENT, default=False)
    words = ["init", *[path] * (path != "."), *options.typed("path"), "--yes"]
    note = f"note: --yes writes these changes, compiles and tests. {TEST}\n"
    sys.stdout.write(f"{note}nothing was written; next: {_pasted(words)}\n")
    return False


def _show_next(path: str, layout: Layout, planned: Sequence[init.Preparation]) -> None:
    """Name the commands that a new user tries next."""
    words = ["check"]
    if not layout.packages:
        words.append("gen")
        if planned[0].compares():
            words.append("breaking")
    commands = [_pasted([word]) for word in words]
    if path != ".":
        commands.insert(0, f"cd {shlex.quote(path)}")
    sys.stdout.writelines(f"next: {line}\n" for line in commands)


def _pasted(words: list[str]) -> str:
    """Return a command of idlc for a shell."""
    return shlex.join([*output.program().split(), *words])


def _plans(layout: Layout, root: Root, report: Report) -> tuple[list[init.Preparation], int]:
    """Say what stands in a folder, plan its packages, and return the plans and the exit status."""
    planned, status = [], 0
    if layout.packages:
        sys.stdout.write(f"{layout.sentence('')}\n")
    for folder in layout.packages or (layout.folder,):
        report, own = Report() if layout.packages else report, Root.at(folder)
        exclude = scope(load_settings(own, Report())).exclude
        number = len(list_files((".",), own, Report(), exclude).files)
        within = one_line(f"{root.shown(folder)}: ") if layout.packages else ""
        if not own.base.is_relative_to(root.base):  # by a link, which may be somebody else's
            sys.stdout.write(f"{within}skipped, because it is outside this folder\n")
            continue
        if layout.packages and not number:
            sys.stdout.write(f"{within}skipped, because it has no interfaces\n")
            continue
        preparation = None
        with suppress(ReportedError):
            inner = layout_of(own, report) if layout.packages else layout
            interfaces = counted(number, "interface") if number else "no interfaces yet"
            sys.stdout.write(f"{within}{one_line(inner.sentence(interfaces))}\n")
            preparation = init.prepare(inner, ScaffoldOptions(own), report, init.siblings(inner))
        sys.stdout.flush()
        output.show(report, "text", sys.stderr)
        if preparation is None:
            sys.stderr.write(f"{within}nothing was written\n")
        else:
            planned.append(preparation)
            sys.stdout.writelines(f"note: {one_line(note)}\n" for note in preparation.notes)
        status = max(status, output.status(report), int(preparation is None))
    return planned, status


def _show(draft: init.Draft, out: str, root: Root) -> None:
    """Show the changes to a package, with the reason for each, and as a diff."""
    if not draft.reasons:
        return
    within = "" if draft.path == root.base else f"{one_line(root.shown(draft.path))}/"
    reasons = [f"{path}: {reason}" for path, reason in draft.reasons.items()]
    reasons += [f"{out}/: the output of `idlc gen`"] * bool(out)
    sys.stdout.writelines(["\n", *(f"{within}{one_line(reason)}\n" for reason in reasons), "\n"])
    with suppress(ReportedError):  # writing reports it
        sys.stdout.writelines(map(printable, draft.write(Report(), dry_run=True).diff))
    sys.stdout.flush()


def _write(draft: init.Draft, next_commands: Sequence[str]) -> int:
    """Write a file that belongs to no package, and return the exit status.

    The next commands belong into the file's repository.
    """
    report = Report()
    if not draft.reasons:
        return 0
    with suppress(ReportedError):
        draft.write(report)
    output.show(report, "text", sys.stderr)
    if next_commands and not output.status(report):
        folder = Root.here().shown(draft.path)
        start = [] if draft.path == Path.cwd() else [f"cd {shlex.quote(folder)}"]
        sys.stdout.writelines(f"next: {line}\n" for line in (*start, *next_commands))
    return output.status(report)


def _finish(preparation: init.Preparation, root: Root, *, again: bool) -> int:
    """Write and compile a package, prove it, and return the exit status.

    A package that did not change is proved `again`, because an earlier proof may have failed.
    """
    report = Report()
    folder = preparation.layout.folder
    within = "" if folder == root.base else f"{one_line(root.shown(folder))}: "
    draft, backend = preparation.draft, preparation.layout.backend
    is_edited = SETUP_PY in draft.reasons and draft.project.has(SETUP_PY)
    before = installed_files(folder, backend) if is_edited and backend else frozenset()
    done = _compile(preparation, within, report)
    if not done:
        return output.status(report) or 1
    if not (draft.reasons or again):
        return 0
    if not preparation.is_packed:
        sys.stdout.write(f"{within}not tested, because the build omits the classes (see above)\n")
        return 1
    sys.stdout.flush()
    source = preparation.source()
    unimportable = codes.DEPENDENCY_NOT_IMPORTABLE.id
    needs = done[0].needs
    is_complete = not needs and all(problem.code != unimportable for problem in report)
    classes = preparation.classes if is_complete else ()
    proof = prove(folder, backend, classes, source, before)
    if proof.tried:
        result = "failed" if proof.failure else "passed"
        sys.stdout.write(f"{within}test {result}: {proof.tried}\n")
    sys.stdout.writelines(f"  {line}\n" for line in proof.failure.splitlines())
    missing = None if is_complete else needs
    untested = _untested(proof, preparation.layout, missing)
    sys.stdout.writelines(f"{within}not tested: {item}\n" for item in untested)
    return int(bool(proof.failure))


def _compile(preparation: init.Preparation, within: str, report: Report) -> tuple[Generated, ...]:
    """Write and compile a package; return the generated packages, none after an error."""
    done: tuple[Generated, ...] = ()
    with suppress(ReportedError):
        preparation.draft.write(report)
        done = init.generate(preparation, report)
    output.show(report, "text", sys.stderr)
    if not done:
        sys.stderr.write(f"{within}idlc did not generate the classes\n")
    for package in done:
        if package.written or package.removed:
            count = counted(package.interfaces, "interface")
            sys.stdout.write(f"{within}compiled {count} into {one_line(package.out)}\n")
    return done


def _untested(proof: Proof, layout: Layout, missing: Sequence[str] | None) -> Iterator[str]:
    """Yield what was not tested, and why; `missing` are packages that the classes import."""
    if proof.obstacle:
        yield proof.obstacle
    if missing is not None:
        names = ", ".join(f"`{name}`" for name in missing) or "a package"
        verb = "are" if len(missing) > 1 else "is"
        yield f"the import, because the classes import {names}, which {verb} not installed"
    if layout.kind == "ament_cmake":
        yield "the CMake build (`colcon build`)"
