"""Prefixes that hold the libraries that idlc writes, and nothing else of a package."""

import sys
from pathlib import Path

from idlc.compiler.compiler import models_of
from idlc.diagnostics.report import Report
from idlc.generate.native.library import MACHINES, libraries
from idlc.project.find import list_files
from idlc.project.inputs import packages
from idlc.project.root import Root
from idlc.project.settings import Scope
from tests.support.installed import installed_layout
from tests.support.paths import PROGRAMS
from tests.support.tools import run, tool

#: The namespace of the second side of a bridge.
FAR = "/far"
INDEX = "share/ament_index/resource_index/packages"


def built(folder, machine="x86_64"):
    """Return the program of native_ask.cpp, built for a machine with ROS 2's own headers."""
    include = Path(sys.prefix, "include")
    folders = [include, *(path for path in include.glob("r*") if path.name != "rcl")]
    options = ["-std=c++17", "-Wall", "-Wextra", "-Werror", *(f"-I{path}" for path in folders)]
    run(tool("g++", machine), *options, PROGRAMS / "native_ask.cpp", "-o", folder / "ask", "-ldl")
    return folder / "ask"


def model_of(folder):
    """Return the model of the package in a folder; what it refers to is found in the wheels."""
    report = Report()
    scope = Scope(Root.here())
    found = packages(
        list_files((str(folder),), scope.root, report, scope.exclude).files, scope, report
    )
    ((_, model),) = models_of(found, scope, report)
    assert not report.had_errors, list(report)
    return model


def install(model, prefix, machine="x86_64", layout=None):
    """Write a package's libraries into a prefix, for what is installed by default; return them."""
    (prefix / INDEX).mkdir(parents=True, exist_ok=True)
    (prefix / INDEX / model.package).write_text("")
    (prefix / "lib").mkdir(exist_ok=True)
    paths = []
    for name, content in libraries(model, MACHINES[machine], layout or installed_layout()).items():
        paths.append(Path(prefix, "lib", name))
        paths[-1].write_bytes(content)
    return paths


def both_ways(names):
    """Return the topics that native_bridge.py is to carry between peer.py on both sides."""
    there = [(name, f"/one/{name}", f"{FAR}/one/{name}", "kept") for name in names]
    return [*there, *((name, f"{FAR}/two/{name}", f"/two/{name}", "kept") for name in names)]
