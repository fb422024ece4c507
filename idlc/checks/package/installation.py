"""Rules on setup.py and its neighbours: what colcon builds can be found and run afterwards."""

from __future__ import annotations

from typing import TYPE_CHECKING

from idlc.checks.package.facts import Facts
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.source import Span
from idlc.model.link import Model

if TYPE_CHECKING:
    from idlc.checks.package.python_files import Setup, Text
    from idlc.diagnostics.source import Source


def _read(setup: Source) -> Setup:
    from idlc.checks.package.python_files import read_setup  # what has no setup.py needs no ast

    return read_setup(setup)


def installed_interfaces(facts: Facts, model: Model, report: Report) -> None:
    """setup.py installs the interface files, without which `ros2 interface show` finds nothing."""
    if facts.setup_py is None or facts.build_type != "ament_python":
        return
    found = _read(facts.setup_py).data_files
    texts = [text.value for text in found or ()]
    for kind in sorted({interface.name.kind for interface in model.own}):
        if found is not None and not texts:
            return  # computed
        if not any(kind in text.replace(".", "/").split("/") for text in texts):
            report.add(
                codes.INTERFACES_NOT_INSTALLED.at(
                    found[0].span if found else Span(facts.setup_py, 0, 0),
                    f"the .{kind} files are not among the `data_files`",
                    hint=f"add `('share/{facts.name}/{kind}', glob('{kind}/*.{kind}'))`",
                )
            )


def installed_libraries(facts: Facts, model: Model, report: Report) -> None:
    """setup.py installs what C++ tools load, where the package is in the index by which they go."""
    if facts.setup_py is None or facts.build_type != "ament_python" or not model.own:
        return
    from idlc.checks.package.libraries import unusable_entry

    report.extend(unusable_entry(facts.setup_py, facts.name))


def resource_marker(facts: Facts, _: Model, report: Report) -> None:
    """The package's marker is there and installed, without which `ros2 run` does not find it."""
    if facts.setup_py is None or facts.build_type != "ament_python":
        return
    found = _read(facts.setup_py).data_files
    if not facts.marker:
        report.add(
            codes.NO_RESOURCE_MARKER.at(
                facts.place,
                f"`resource/{facts.name}` is missing, the file by which ROS 2 finds the package",
                hint=f"create it: `mkdir -p resource && touch resource/{facts.name}`",
            )
        )
    elif not found or not any("resource_index/packages" in text.value for text in found):
        report.add(
            codes.NO_RESOURCE_MARKER.at(
                Span(facts.setup_py, 0, 0),
                f"`resource/{facts.name}` is not among the `data_files`",
                hint="add `('share/ament_index/resource_index/packages', "
                f"['resource/{facts.name}'])`",
            )
        )


def entry_points(facts: Facts, _: Model, report: Report) -> None:
    """Each console script names a function that is there."""
    if facts.setup_py is None:
        return
    for text in _read(facts.setup_py).scripts:
        problem = _problem(text, facts)
        if problem:
            report.add(codes.BAD_ENTRY_POINT.at(text.span, problem[0], hint=problem[1]))


def _problem(text: Text, facts: Facts) -> tuple[str, str] | None:
    from idlc.checks.package.python_files import defines

    script, equals, target = text.value.partition("=")
    module, colon, function = (part.strip() for part in target.partition(":"))
    if not equals or not colon or not function:
        what = f"`{text.value}` is not an entry point"
        return what, f"write `{script.strip() or 'NAME'} = {facts.name}.MODULE:main`"
    if module.partition(".")[0] not in {name.partition(".")[0] for name in facts.modules}:
        return (
            f"there is no Python package `{module.partition('.')[0]}` here",
            f"it is `{facts.name}` by the package.xml",
        )
    source = facts.modules.get(module) or facts.modules.get(f"{module}.__init__")
    if source is None:
        return f"there is no module `{module}`", "name the file that holds the function"
    if not defines(source, function.partition(".")[0]):
        return f"`{source.path}` has no `{function}`", f"define it: `def {function}() -> None:`"
    return None


def names(facts: Facts, _: Model, report: Report) -> None:
    """setup.py and setup.cfg call the package what package.xml calls it."""
    found = _read(facts.setup_py).name if facts.setup_py else None
    if found is not None and found.value.replace("-", "_") != facts.name:
        report.add(
            codes.NAME_MISMATCH.at(
                found.span,
                f"setup.py calls the package `{found.value}`, package.xml `{facts.name}`",
                hint="give both the same name",
            )
        )
    if facts.setup_cfg is None:
        return
    for line, start in zip(facts.setup_cfg.lines, facts.setup_cfg.line_starts, strict=False):
        key, equals, value = line.partition("=")
        folder = value.strip()
        script = key.strip().replace("-", "_") in ("script_dir", "install_scripts")
        if equals and script and "/lib/" in folder and not folder.endswith(f"/lib/{facts.name}"):
            at = start + line.index(folder)
            report.add(
                codes.NAME_MISMATCH.at(
                    Span(facts.setup_cfg, at, at + len(folder)),
                    f"`ros2 run` looks for scripts in `lib/{facts.name}`",
                    hint=f"write `$base/lib/{facts.name}`",
                )
            )


def current_output(facts: Facts, _: Model, report: Report) -> None:
    """Code that idlc generated here is made of the interfaces as they are now."""
    for output in facts.outputs:
        if output.package != facts.name or not facts.whole:
            continue
        changed = {
            name
            for name in output.inputs.keys() | facts.inputs.keys()
            if output.inputs.get(name) != facts.inputs.get(name)
        }
        if changed:
            listed = first_few((f"`{name}`" for name in sorted(changed)), 3)
            report.add(
                codes.STALE_GENERATED_CODE.of(
                    output.path,
                    f"the generated code is out of date: {listed} changed",
                    hint="run idlc gen",
                )
            )
