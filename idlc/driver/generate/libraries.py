"""The libraries of a package for C++ tools, as this machine and its ROS 2 want them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from idlc.disk.machine import environment
from idlc.disk.machine.distribution import DEFAULT, Distribution, distribution
from idlc.driver.stages import stage

if TYPE_CHECKING:
    from idlc.model.link import Model
    from idlc.native.layouts import Layout
    from idlc.native.machine import Machine


class Libraries(NamedTuple):
    """The libraries of a package by their paths in a prefix, such as `lib/libNAME.so`.

    `missing` says why there are none although the package has interfaces. Such a package must not
    be registered in the index of ROS 2: recorders stop at it. `build_tag` is what a wheel of the
    package has in its name, so that wheels for different distributions have different names.
    """

    files: Mapping[str, bytes]
    missing: str = ""
    build_tag: str = ""


def libraries_of(model: Model, found: Distribution | None = None) -> Libraries:
    """Return the libraries of a model without errors, by default for what is installed here.

    Who writes them moves them into place: programs may have the old ones open.
    """
    from idlc.native.library import libraries

    found = found or distribution()
    target = target_of(found)
    if not model.own or isinstance(target, str):
        missing = target if model.own and isinstance(target, str) else ""
        return Libraries({}, missing, build_tag(model))
    with stage("libraries", model.package):
        files = libraries(model, *target)
    placed = {f"lib/{name}": content for name, content in files.items()}
    return Libraries(placed, build_tag=build_tag(model, found.name))


def build_tag(model: Model, *libraries: str) -> str:
    """Return a wheel's build tag; `libraries` is the distribution that it has libraries for."""
    names = dict.fromkeys((model.distro.name, *libraries))
    return "" if list(names) == [DEFAULT] else f"1{'_'.join(names)}"


def target_of(found: Distribution) -> tuple[Machine, Layout] | str:
    """Return for which processor and layout libraries are made here, or why none can be."""
    from idlc.native.layouts import LAYOUTS
    from idlc.native.library import MACHINES

    machine = MACHINES.get(environment.machine())
    layout = LAYOUTS.get(found.name)
    if machine is None:
        return f"idlc makes libraries for Linux on {' and '.join(MACHINES)}, and this is neither"
    if layout is None:
        return f"idlc does not know this distribution of ROS 2 ({found.why})"
    return machine, layout
