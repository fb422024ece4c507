"""The build hook of hatchling that compiles a library's interfaces.

hatchling imports this module in every build that looks for hooks of others, so it imports little.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from hatchling.builders.config import BuilderConfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.plugin import hookimpl

if TYPE_CHECKING:
    from idlc.build.library import CompiledLibrary
    from idlc.diagnostics.report import Report

#: The settings that hatchling itself reads of each hook.
_SETTINGS = frozenset(
    "dependencies enable-by-default require-runtime-dependencies require-runtime-features".split()
)


class InterfacesHook(BuildHookInterface[BuilderConfig]):
    """Adds classes to wheels, and the files that they are compiled from to source distributions."""

    PLUGIN_NAME = "idlc"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile into a temporary folder, from which hatchling takes files."""
        from idlc.build.hooks import finished
        from idlc.build.library import compile_library, sources
        from idlc.diagnostics import codes

        self.folder = TemporaryDirectory(prefix="idlc-")
        project, folder = Path(self.root), Path(self.folder.name)
        added = build_data["force_include"]
        if self.target_name == "sdist":
            added |= {str(project / path): path for path in sources(project)}
            return
        requirements = [*self.metadata.core.dependencies, *build_data["dependencies"]]
        installed_path = self.build_config.get_distribution_path
        installed_path("")  # hatchling's errors about files to pack end the build as always

        def build(report: Report) -> CompiledLibrary:
            for key in self.config.keys() - _SETTINGS:
                message = f"unknown setting `{key}` of the build hook idlc"
                hint = "write settings for idlc into [tool.idlc]"
                report.add(codes.BAD_CONFIG.of("", message, hint=hint))
            return compile_library(project, folder, installed_path, requirements, report)

        library = finished(build)
        if version == "editable":
            # hatchling includes these alone if another hook has set any
            added = build_data["force_include_editable"] or added
            for name, text in library.finder().items():
                (folder / name).write_text(text, encoding="utf-8")
                added[str(folder / name)] = name
        added |= {str(path): f"{library.out}/{key}" for key, path in library.files.items()}

    def finalize(self, *_: Any) -> None:
        """Remove the temporary folder."""
        self.folder.cleanup()


@hookimpl
def hatch_register_build_hook() -> type[InterfacesHook]:
    """Return the hook, which hatchling finds by an entry point."""
    return InterfacesHook
