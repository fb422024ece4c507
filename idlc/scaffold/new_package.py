"""A new package: its files, which build with colcon and install with pip."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import escape, quoteattr

from idlc.emit.package_name import why_not_package
from idlc.scaffold.templates import Templates

VERSION = "0.1.0"
LICENSES = ("Apache-2.0", "BSD-3-Clause", "MIT")
_TEXTS = Path(__file__).parent / "licenses"

PYTHON = "ament_python"
CMAKE = "ament_cmake"
#: What interfaces need of ROS 2 itself: events of services, goals and states of actions.
IMPLIED = ("action_msgs", "service_msgs", "unique_identifier_msgs")


class Package(NamedTuple):
    """What the templates of a new package show.

    `depends` are the packages that one of interfaces only depends on.
    """

    name: str
    description: str
    maintainer: str
    email: str
    license: str
    build_type: str = PYTHON
    version: str = VERSION
    depends: tuple[str, ...] = IMPLIED

    @property
    def is_python(self) -> bool:
        """Whether the package has nodes."""
        return self.build_type == PYTHON

    @property
    def xml_description(self) -> str:
        """The description in XML."""
        return escape(self.description)

    @property
    def xml_maintainer(self) -> str:
        """The maintainer in XML."""
        return escape(self.maintainer)

    @property
    def xml_email(self) -> str:
        """The maintainer's address within an attribute's quotes."""
        return quoteattr(self.email)[1:-1].replace('"', "&quot;")

    @property
    def py_maintainer(self) -> str:
        """The maintainer as a Python literal."""
        return repr(self.maintainer)

    @property
    def py_email(self) -> str:
        """The maintainer's address as a Python literal."""
        return repr(self.email)

    @property
    def py_description(self) -> str:
        """The description as a Python literal."""
        return repr(self.description)

    @property
    def xml_depends(self) -> tuple[str, ...]:
        """The dependencies, as lines of package.xml."""
        lines = _PYTHON_DEPENDS if self.is_python else _cmake_depends(self.depends)
        return tuple(f"  <{tag}>{name}</{tag}>" if tag else "" for tag, name in lines)


def _cmake_depends(packages: Iterable[str]) -> tuple[tuple[str, str], ...]:
    return (
        ("buildtool_depend", "ament_cmake"),
        ("buildtool_depend", "rosidl_default_generators"),
        ("", ""),
        *(("depend", name) for name in packages),
        ("exec_depend", "rosidl_default_runtime"),
        ("", ""),
        ("member_of_group", "rosidl_interface_packages"),
    )


_PYTHON_DEPENDS = (
    ("depend", "rclpy"),
    ("exec_depend", "launch"),
    ("exec_depend", "launch_ros"),
    ("exec_depend", "python3-numpy"),
    ("", ""),
    ("test_depend", "ament_flake8"),
    ("test_depend", "ament_pep257"),
    ("test_depend", "python3-pytest"),
)


#: Files of a package of nodes, each with its template; NAME stands for the package.
_PYTHON_FILES = {
    "package.xml": "package/package.xml.jinja",
    "setup.py": "package/setup.py.jinja",
    "setup.cfg": "package/setup.cfg.jinja",
    "pyproject.toml": "package/pyproject.toml.jinja",
    "launch/NAME_launch.py": "package/launch.py.jinja",
    "test/conftest.py": "package/conftest.py.jinja",
    "test/test_style.py": "package/test_style.py.jinja",
    "README.md": "package/README.md.jinja",
    ".gitattributes": "package/gitattributes.jinja",
    ".gitignore": "package/gitignore.jinja",
}
_CMAKE_FILES = {
    "package.xml": "package/package.xml.jinja",
    "CMakeLists.txt": "package/CMakeLists.txt.jinja",
    "pyproject.toml": "package/interfaces_pyproject.toml.jinja",
    "README.md": "package/README.md.jinja",
    ".gitignore": "package/gitignore.jinja",
}
#: Files of a new package that are edited later on.
GROWING = (
    *("package.xml", "setup.py", "pyproject.toml", "setup.cfg", "CMakeLists.txt"),
    *("README.md", ".gitattributes", ".gitignore"),
)
#: What would not be found any more next to a package of such a name.
_TAKEN = frozenset(
    "action idlc launch launch_ros msg pytest rclpy resource setuptools srv test".split()
)


def check_name(name: str) -> str:
    """Return the name of a new package; one that hides another module is refused."""
    why = why_not_package(name)
    if not why and name in _TAKEN:
        why = "is the name of a folder or a module that it needs"
    if why:
        raise ValueError(f"`{name}` {why}")
    return name


def plain(name: str) -> Package:
    """Return a package of which only the name matters."""
    return Package(name, "", "", "", LICENSES[0])


def files(package: Package, templates: Templates) -> dict[str, str]:
    """Return the texts of a new package's files by their paths in its folder."""
    listed = _CMAKE_FILES if package.build_type == CMAKE else _PYTHON_FILES
    found = {
        path.replace("NAME", package.name): rendered(template, package, templates)
        for path, template in listed.items()
    }
    found["LICENSE"] = license_text(package)
    if package.build_type == PYTHON:
        found[f"resource/{package.name}"] = ""
        found[f"{package.name}/__init__.py"] = f'"""Nodes and interfaces of {package.name}."""\n'
    return found


def rendered(template: str, package: Package, templates: Templates) -> str:
    """Return the text of one of a package's files."""
    return templates.render(template, package=package)


def license_text(package: Package) -> str:
    """Return the text of a licence, with the maintainer as the holder where it names one."""
    text = (_TEXTS / f"{package.license}.txt").read_text(encoding="utf-8")
    return text.replace("(c) HOLDER", f"(c) {package.maintainer}")
