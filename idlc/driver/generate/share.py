"""What rosidl would install of a package besides its modules, by the paths in a prefix."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from idlc.diagnostics.report import Report
from idlc.disk.machine.environment import INDEX
from idlc.driver.generate.libraries import Libraries
from idlc.export.file_text import file_text
from idlc.export.idl import idl

if TYPE_CHECKING:
    from idlc.model.link import Model

#: The list of the packages that have interfaces, each a file with their names.
INTERFACES = f"{INDEX}/rosidl_interfaces"


def shared(
    model: Model, manifest: str | bytes | None, libraries: Libraries, report: Report
) -> dict[str, bytes]:
    """Return libraries, package.xml, interfaces and entries in the index, in the order to write.

    What leads to others comes after these. Without libraries the package is registered neither as
    a package nor as one with interfaces: recorders stop at the one, `ros2 interface list` at the
    other alone.
    """
    name = model.package
    found: dict[str, str | bytes] = {**libraries.files}
    if manifest is not None:
        found[f"share/{name}/package.xml"] = manifest
    interfaces = {}
    for own in model.own:
        key = f"{own.name.kind}/{own.name.name}"
        interfaces[f"{key}.{own.name.kind}"] = file_text(own)
        interfaces[f"{key}.idl"] = idl(own)
        described = model.describer.installed(str(own.name))
        found[f"share/{name}/{key}.json"] = json.dumps(described, indent=2)
    found |= {f"share/{name}/{path}": text for path, text in interfaces.items()}
    found[f"{INDEX}/package_run_dependencies/{name}"] = ";".join(dependencies(model))
    if libraries.missing:
        report.notes.append(
            f"`{name}` is not registered in the index of ROS 2, because recorders stop at packages "
            f"without a library: {libraries.missing}"
        )
    else:
        found[f"{INTERFACES}/{name}"] = "\n".join(sorted(interfaces))
        found[f"{INDEX}/packages/{name}"] = ""
    return {
        path: content.encode() if isinstance(content, str) else content
        for path, content in found.items()
    }


def dependencies(model: Model) -> list[str]:
    """Return the packages whose interfaces a model has besides its own."""
    return sorted({one.package for one in model.interfaces} - {model.package})
