"""One run of a hook: read what the package declares, compile, have hatchling write the archive.

A problem ends the process with a report, as frontends expect it; they would show an exception with
its traceback.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from idlc.build import content
from idlc.check.manifest import names_runtime
from idlc.cli import output
from idlc.cli.exit_status import status_of
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError, first_few
from idlc.diagnostics.text import Audience, addressed_to, did_you_mean
from idlc.project import prefixes, settings
from idlc.project.files import reason
from idlc.project.prefixes import Distribution
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import Config, load_settings
from idlc.version import RUNTIME, __version__

if TYPE_CHECKING:
    from hatchling.builders.plugin.interface import BuilderInterface, IncludedFile
    from hatchling.builders.wheel import RecordFile, WheelArchive

_Built = TypeVar("_Built")
#: The name of a package, and its `[project]` table.
_Package: TypeAlias = tuple[str, dict[str, Any]]
#: Outputs of a workspace or an earlier build in the folder.
_NO_SOURCES = ["/build", "/dist", "/install", "/log"]
#: Files that are needed even if version control ignores them.
_SOURCES = ["/package.xml", "/msg/*.msg", "/srv/*.srv", "/action/*.action"]


def archive(build: Callable[[Report], str]) -> str:
    """Return the name of the archive that was built; end the process after a problem."""
    if importlib.util.find_spec("hatchling") is None:
        sys.stderr.write(
            "error: idlc.backend needs hatchling, which is not installed\n"
            "  = hint: `pip install hatchling`, or build without --no-build-isolation\n"
        )
        raise SystemExit(2)
    return finished(build)


def finished(build: Callable[[Report], _Built]) -> _Built:
    """Return what was built; end the process with a report after a problem."""
    built: list[_Built] = []

    def command() -> int:
        report = Report()
        try:
            with addressed_to(Audience.SETTINGS), suppress(ReportedError):
                built.append(build(report))
        except OSError as error:
            message = f"cannot write the archive: {reason(error)}"
            report.add(codes.CANNOT_WRITE.of(str(error.filename or ""), message))
        output.show(report, "text", sys.stderr)
        output.notes(report, sys.stderr)
        return 0 if built else output.status(report) or 1

    status = status_of(command)
    if status:
        sys.stderr.write("idlc: nothing was built, see above\n")
        raise SystemExit(status)
    return built[0]


def sdist(directory: str, settings: Mapping[str, Any], report: Report) -> str:
    """Write the archive of the working folder, without what version control ignores.

    Links that lead out of the folder are left out, and noted: an archive is given to others.
    """
    from hatchling.builders.sdist import SdistBuilder, SdistBuilderConfig

    root = Path.cwd().resolve()
    outside: set[str] = set()

    def leads_out(path: str) -> bool:
        is_outside = not Path(os.path.realpath(path)).is_relative_to(root)  # of circles, too
        if is_outside:
            outside.add(Path(os.path.relpath(path, root)).as_posix())
        return is_outside

    class Config(SdistBuilderConfig):
        def directory_is_excluded(self, name: str, relative_path: str) -> bool:
            left_out: bool = super().directory_is_excluded(name, relative_path)
            return left_out or leads_out(str(root / relative_path / name))

    class PackageSdist(SdistBuilder):
        @classmethod
        def get_config_class(cls) -> type[SdistBuilderConfig]:
            return Config

        def recurse_included_files(self) -> Iterator[IncludedFile]:
            files = super().recurse_included_files()
            yield from (file for file in files if not leads_out(file.path))

    (_, project), _ = _declared(settings, report)
    settings = {"project": project, **_target("sdist", exclude=_NO_SOURCES, artifacts=_SOURCES)}
    name = _written(PackageSdist(str(root), config=settings), directory, report)
    if outside:
        names = first_few((f"`{path}`" for path in sorted(outside)), 5)
        report.notes.append(f"skipped, because they lead out of the project: {names}")
    return name


def wheel(directory: str, settings: Mapping[str, Any], report: Report) -> str:
    """Compile the package in the working folder into a wheel."""
    from hatchling.builders.wheel import WheelBuilder

    (name, project), options = _declared(settings, report)
    with tempfile.TemporaryDirectory(prefix="idlc-") as folder:
        classes, prefix = Path(folder) / "classes" / name, Path(folder) / "prefix"
        compiled = content.compile_package(name, classes, options, report)
        native, tag = compiled.libraries.files, compiled.libraries.build_tag

        platform = f"py3-none-{prefixes.wheel_platform() if native else 'any'}"

        class PackageWheel(WheelBuilder):
            def get_default_build_data(self) -> dict[str, Any]:
                return {**super().get_default_build_data(), "tag": platform}

            @staticmethod
            def write_archive_metadata(
                archive: WheelArchive, records: RecordFile, build_data: dict[str, Any]
            ) -> None:
                """Write WHEEL with the build tag, which hatchling does not know."""
                lines = ["Wheel-Version: 1.0", f"Generator: idlc {__version__}"]
                lines += [f"Root-Is-Purelib: {str(build_data['pure_python']).lower()}"]
                lines += [f"Build: {tag}"] * bool(tag) + [f"Tag: {platform}", ""]
                records.write(archive.write_metadata("WHEEL", "\n".join(lines)))

        for path, data in compiled.prefix.items():
            (prefix / path).parent.mkdir(parents=True, exist_ok=True)
            (prefix / path).write_bytes(data)
        target = _target(
            "wheel",
            **{
                "bypass-selection": True,
                "exclude": [f"/{name}", f"/src/{name}"],  # committed classes: these are new ones
                "force-include": {str(classes): name},
                "shared-data": {str(prefix / path): path for path in sorted(compiled.prefix)},
            },
        )
        builder = PackageWheel(str(Path.cwd()), config={"project": project, **target})
        # hatchling knows no build tags, and its file must not replace a wheel without one
        Path(directory).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".idlc-", dir=directory) as beside:
            built = _written(builder, beside, report)
            stem, python, rest = built.partition("-py3-")
            archive = f"{stem}-{tag}{python}{rest}" if tag else built
            Path(beside, built).replace(Path(directory, archive))
    return archive


def _declared(settings: Mapping[str, Any], report: Report) -> tuple[_Package, content.Options]:
    """Return the package, and what a frontend's settings say. Raises ReportedError."""
    package = None
    with suppress(ReportedError):  # so that problems of both are reported
        package = _package(report)
    options = _options(settings, report)
    report.raise_errors()
    assert package is not None
    return package, options


def _package(report: Report) -> _Package:
    """Return the package's name and its `[project]` table. Raises ReportedError."""
    config = load_settings(Root.here(), report)
    if not Path(MANIFEST).is_file():
        message = f"there is no {MANIFEST} next to pyproject.toml"
        hint = "`idlc scaffold package NAME --interfaces` creates a folder that you can build"
        report.add(codes.NO_SUCH_PATH.of(MANIFEST, message, hint=hint))
    report.raise_errors()
    declared = content.project(config.runtime, report)
    project = content.complete_table(declared, report)
    require_runtime(config, project.get("dependencies", ()), report)
    report.raise_errors()
    return declared["name"], project


def require_runtime(config: Config, requirements: Iterable[str], report: Report) -> None:
    """Report IDL459 if classes import the installed runtime, which no requirement names."""
    if config.runtime == "installed" and not names_runtime(requirements):
        message = "the classes import `idlc_runtime`, but [project] does not require it"
        hint = f'add "{RUNTIME}" to `dependencies`'
        report.add(codes.UNDECLARED_IMPORT.of(settings.SETTINGS_FILE, message, hint=hint))


def _options(settings: Mapping[str, Any], report: Report) -> content.Options:
    """Return what a frontend's settings say; report IDL611 for each that is wrong."""
    from idlc.generate.native.platforms import LAYOUTS

    choices = {"distro": tuple(LAYOUTS), "libraries": ("yes", "no")}
    for key, value in settings.items():
        if key not in choices:
            message = f"unknown setting `{key}` of idlc.backend"
            hint = did_you_mean(key, choices) or f"the settings are {', '.join(choices)}"
            report.add(codes.BAD_CONFIG.of("", message, hint=hint))
        elif value not in choices[key]:
            message = f"the setting `{key}` is {value!r}, which idlc does not support"
            report.add(codes.BAD_CONFIG.of("", message, hint=f"use {', '.join(choices[key])}"))
    distro = settings.get("distro")
    distribution = Distribution(distro, f"distro={distro}") if distro else None
    return content.Options(distribution, settings.get("libraries") != "no")


def _target(name: str, **settings: Any) -> dict[str, Any]:
    """Return hatchling's settings for one kind of archive."""
    every = {"core-metadata-version": "2.4"}
    return {"tool": {"hatch": {"build": {"targets": {name: {**every, **settings}}}}}}


def _written(builder: BuilderInterface[Any, Any], directory: str, report: Report) -> str:
    """Return the name of an archive, written; report IDL611 for a `[project]` that is wrong."""
    try:
        builder.metadata.validate_fields()
    except (OSError, TypeError, ValueError) as error:
        problem = codes.BAD_CONFIG.of(settings.SETTINGS_FILE, f"{error}")
        raise report.refused(problem) from None
    return Path(next(iter(builder.build(directory=directory, versions=["standard"])))).name
