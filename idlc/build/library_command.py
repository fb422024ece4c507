"""The command of setuptools that compiles a library's interfaces while the library is built."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from functools import partial
from importlib import import_module
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

from idlc.build.hooks import finished
from idlc.build.library import CompiledLibrary, compile_library, sources
from idlc.diagnostics.report import Report
from idlc.project.lock import FILE, load_lock


def build_command() -> type:
    """Return the command, a subclass of one of setuptools, which idlc does not require."""
    base: Any = import_module("setuptools").Command

    def initialize_options(self: Any) -> None:
        self.build_lib = None

    def finalize_options(self: Any) -> None:
        self.set_undefined_options("build", ("build_lib", "build_lib"))

    def run(self: Any) -> None:
        project, requirements = Path.cwd(), self.distribution.install_requires or ()
        site = Path(self.build_lib)
        if self.editable_mode:  # nothing is taken from there
            site = Path(self.get_finalized_command("install").install_lib)
        package_dir = self.distribution.package_dir or {}
        with TemporaryDirectory(prefix="idlc-") as folder:

            def build(report: Report) -> CompiledLibrary:
                installed_path = partial(_installed_path, package_dir)
                return compile_library(project, Path(folder), installed_path, requirements, report)

            library = finished(build)
            _install(library, site)
        if self.editable_mode:
            for name, text in library.finder().items():
                (site / name).write_text(text, encoding="utf-8")
        elif not self.distribution.has_pure_modules():
            self.distribution.has_pure_modules = lambda: True  # these are some

    def get_source_files(self: Any) -> list[str]:  # noqa: ARG001
        return sources(Path.cwd())

    methods = (initialize_options, finalize_options, run, get_source_files)
    attributes = {"editable_mode": False, "user_options": []}
    named = {method.__name__: method for method in methods}
    return type("build_idlc", (base,), {**attributes, **named})


def _install(library: CompiledLibrary, site: Path) -> None:
    """Copy files to where they are imported from, and remove those of an earlier build."""
    target = site.joinpath(*library.module.split("."))
    for lock_file in target.rglob(FILE):
        lock = load_lock(lock_file.parent, "", Report())
        for path in lock.outputs if lock else ():
            if path != "__init__.py":  # which may be people's
                (lock_file.parent / path).unlink(missing_ok=True)
    for path, source in library.files.items():
        (target / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target / path)


def _installed_path(package_dir: Mapping[str, str], path: str) -> str:
    """Return the path below site-packages of a path, by the folders of packages.

    The path begins with `..` if setuptools packs nothing of its folder.
    """
    # setuptools has not seen a folder `src` that has only classes
    top = "src" if PurePath(path).parts[:1] == ("src",) else ""
    for package, folder in sorted({"": top, **package_dir}.items(), reverse=True):
        if PurePath(path).is_relative_to(folder):
            return str(PurePath(*package.split("."), PurePath(path).relative_to(folder)))
    return f"../{path}"
