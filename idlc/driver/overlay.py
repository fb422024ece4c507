"""A package as `idlc gen --ament` installs it: its modules, and what rosidl would install."""

from __future__ import annotations

import json
from collections.abc import Mapping
from shlex import quote
from typing import TYPE_CHECKING

from idlc.disk.distribution import distribution
from idlc.disk.overlay import Overlay
from idlc.driver.libraries import libraries_of
from idlc.model.idl import idl

if TYPE_CHECKING:
    from idlc.model.link import Model

_INDEX = "share/ament_index/resource_index"
_SHELLS = ("sh", "bash", "zsh")


def overlaid(model: Model, modules: Mapping[str, str], overlay: Overlay) -> dict[str, str | bytes]:
    """Return the files of a package by their paths in the prefix.

    They are in the order in which to write them: what leads to others comes after these.
    """
    name = model.package
    found: dict[str, str | bytes] = {f"{overlay.modules}{path}": modules[path] for path in modules}
    libraries = libraries_of(model, distribution(overlay.prefixes))
    found |= libraries.files
    depends = sorted({one.package for one in model.interfaces} - {name})
    found[f"share/{name}/package.xml"] = overlay.manifest or _rendered(
        "overlay_package.xml.jinja", name=name, depends=depends
    )
    interfaces = {}
    for own in model.own:
        key = f"{own.name.kind}/{own.name.name}"
        description = json.dumps(model.describer.installed(str(own.name)), indent=2)
        interfaces[f"{key}.{own.name.kind}"] = own.source.text if own.source else ""
        interfaces[f"{key}.idl"] = idl(own)
        found[f"share/{name}/{key}.json"] = f"{description}\n"
    found |= {f"share/{name}/{path}": text for path, text in interfaces.items()}
    found[f"{_INDEX}/package_run_dependencies/{name}"] = ";".join(depends)
    found[f"{_INDEX}/rosidl_interfaces/{name}"] = "\n".join(sorted(interfaces))
    if libraries.missing:
        overlay.report.notes.append(
            f"`{name}` is not entered in the index of ROS 2, because recorders stop at packages "
            f"without a library: {libraries.missing}"
        )
    else:
        found[f"{_INDEX}/packages/{name}"] = ""
    return found


def enter(overlay: Overlay) -> bool:
    """Write the files by which a shell learns of the prefix; return whether that went well."""
    files = {
        f"{name}.{shell}": _rendered(f"overlay_setup.{shell}.jinja", prefix=quote(overlay.place))
        for shell in _SHELLS
        for name in ("local_setup", "setup")
    }
    return overlay.share(files)


def _rendered(template: str, **given: object) -> str:
    from idlc.emit.render import environment

    return environment().get_template(template).render(**given)
