"""From the model to the files of a package, by way of the view-model and the templates.

Pure but for reading idlc's own templates and runtime. `idlc.lock` is not made here.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import jinja2

from idlc.emit import listing, pynames, type_data, view
from idlc.model import ir, link
from idlc.templating import RenderedFile, environment

PACKAGE = Path(__file__).parent.parent


@cache
def _template(name: str) -> jinja2.Template:
    return environment().get_template(name)


@cache
def runtime_files() -> tuple[RenderedFile, ...]:
    """Return the support package, a verbatim copy of idlc.runtime."""
    runtime = PACKAGE / "runtime"
    return tuple(
        RenderedFile(
            f"_idlc/{path.relative_to(runtime).as_posix()}", path.read_text(encoding="utf-8")
        )
        for path in sorted(runtime.rglob("*.py"))
    )


def support_packages() -> list[str]:
    """Return the Python packages that the support package consists of, itself first."""
    return sorted({file.path.rpartition("/")[0].replace("/", ".") for file in runtime_files()})


def module_files(
    interface: ir.Interface, model: link.Model, modules: pynames.Modules, around: str = ""
) -> Iterator[RenderedFile]:
    """Yield the modules of one interface."""
    converts = model.distro.converts_values
    for module in view.modules(interface, model.messages, modules, around, converts=converts):
        template = _template(f"message/{module.template}.py.jinja")
        yield RenderedFile(module.path, template.render(module=module))


def render_package(model: link.Model, around: str = "") -> tuple[RenderedFile, ...]:
    """Return all files of a generated package but its lock, sorted by path.

    Other packages are imported from the Python package `around`, if that is not empty.
    The model must be without errors: no `Unknown` type, nothing that is not found.
    """
    modules = pynames.modules(interface.name for interface in model.own)
    files = [file for own in model.own for file in module_files(own, model, modules, around)]
    for kind in sorted({interface.name.kind for interface in model.own}):
        page = listing.package(model, kind, modules)
        text = _template("message/package_init.py.jinja").render(package=page)
        files.append(RenderedFile(page.path, text))
    files.append(RenderedFile("_idlc/type_data.py", type_data.source(model, around)))
    # a package without it would lose to any other of its name, wherever that stands on the path
    files.append(RenderedFile("__init__.py", f'"""The interfaces of {model.package}."""\n'))
    files.append(RenderedFile("py.typed", ""))
    return tuple(sorted((*files, *runtime_files()), key=lambda file: file.path))
