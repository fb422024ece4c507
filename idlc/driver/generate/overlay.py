"""A package as `idlc gen --ament` installs it: its modules, and what rosidl would install."""

from __future__ import annotations

from collections.abc import Mapping
from shlex import quote
from typing import TYPE_CHECKING

from idlc.disk.output.folder import Target
from idlc.disk.output.overlay import Overlay
from idlc.driver.generate.libraries import libraries_of
from idlc.driver.generate.share import dependencies, shared

if TYPE_CHECKING:
    from idlc.model.link import Model

_SHELLS = ("sh", "bash", "zsh")


def overlaid(model: Model, modules: Mapping[str, str], overlay: Target) -> dict[str, str | bytes]:
    """Return the files of a package by their paths in the prefix.

    They are in the order in which to write them: what leads to others comes after these.
    """
    assert isinstance(overlay, Overlay)
    manifest = overlay.manifest or _rendered(
        "overlay/package.xml.jinja", name=model.package, depends=dependencies(model)
    )
    libraries = libraries_of(model, overlay.distribution)
    placed = {f"{overlay.modules}{path}": modules[path] for path in modules}
    return {**placed, **shared(model, manifest, libraries, overlay.report)}


def enter(overlay: Target) -> bool:
    """Write the files by which a shell learns of the prefix; return whether that went well."""
    assert isinstance(overlay, Overlay)
    files = {
        f"{name}.{shell}": _rendered(f"overlay/setup.{shell}.jinja", prefix=quote(overlay.place))
        for shell in _SHELLS
        for name in ("local_setup", "setup")
    }
    return overlay.share(files)


def _rendered(template: str, **given: object) -> str:
    from idlc.templating import environment

    return environment().get_template(template).render(**given)
