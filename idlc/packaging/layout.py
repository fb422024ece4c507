"""The Python packages that setuptools installs, and their folders, as far as files show.

setup.py lists them, or setup.cfg, or pyproject.toml; otherwise setuptools searches itself.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from posixpath import normpath
from typing import Any, NamedTuple

from idlc.diagnostics.source import Source, Span
from idlc.packaging.files import SetupCfg
from idlc.packaging.setup_py import Setup, name_of_call
from idlc.project.settings import toml

_SEARCH = ("where", "include", "exclude")
_FINDERS = ("find_packages", "find_namespace_packages")
#: Characters of the longest pyproject.toml that is read.
_MOST = 100_000
_MOST_ROOTS = 20
#: Arguments with which other code may choose the packages.
_HOOKS = frozenset({"distclass", "pbr", "py_modules", "setup_requires"})
#: Folders that setuptools ignores in its own search.
_NOT_FOUND = frozenset(
    "ci bin debian doc docs documentation manpages news newsfragments changelog test tests "
    "unit_test unit_tests example examples scripts tools util utils python build benchmark "
    "benchmarks exercise exercises htmlcov".split()
)


class Finder(NamedTuple):
    """A search for packages below a folder, by patterns of their names."""

    where: str = "."
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()

    def finds(self, name: str) -> bool:
        """Return whether a package of this name is found if its folder exists."""
        is_included = any(fnmatchcase(name, pattern) for pattern in self.include or ("*",))
        return is_included and not any(fnmatchcase(name, pattern) for pattern in self.exclude)


class Installed(NamedTuple):
    """The listed packages and searches, and the range that lists them.

    `is_nothing`: nothing lists them; setuptools would find several, and installs none.
    """

    place: Span
    names: tuple[str, ...] = ()
    finders: tuple[Finder, ...] = ()
    is_nothing: bool = False

    def covers(self, name: str, folder: str) -> bool:
        """Return whether a package in a folder is installed."""
        path = name.replace(".", "/")
        return name in self.names or any(
            normpath(f"{finder.where}/{path}") == folder and finder.finds(name)
            for finder in self.finders
        )


class PackagingConfig(NamedTuple):
    """The packages and `package_dir` in one file, each `None` if the file has no such setting."""

    packages: Installed | None = None
    roots: Mapping[str, str] | None = None


class PackageLayout(NamedTuple):
    """The folders of packages, and the packages that setuptools installs, `None` if unknown."""

    roots: Mapping[str, str]
    installed: Installed | None

    def folder(self, package: str) -> str:
        """Return the folder of a package, relative to setup.py."""
        names = package.split(".")
        end = len(names)
        while end and ".".join(names[:end]) not in self.roots:
            end -= 1
        root = self.roots.get(".".join(names[:end])) or "."
        return normpath("/".join((root, *names[end:])))

    def packages(self, folders: Mapping[str, bool]) -> dict[str, bool]:
        """Return folders by the names that their packages have in setuptools."""
        if not self.roots:
            return dict(folders)
        packages = {} if "" in self.roots else dict(folders)
        for package, root in self.roots.items():
            at = normpath(root).replace("/", ".")
            for name, has_init in folders.items():
                if f"{name}.".startswith(f"{at}."):
                    inner = name[len(at) + 1 :]
                    packages[".".join(filter(None, (package, inner)))] = has_init
        packages.pop("", None)
        return packages


def layout(
    setup: Setup, cfg: Source | None, pyproject: Source | None, folders: Mapping[str, bool]
) -> PackageLayout | None:
    """Return setuptools' view of a package; `None` if the folders of packages are unknown.

    `folders` are the existing ones, by dotted name.
    """
    of_setup, of_cfg, of_toml = _of_setup(setup), _of_cfg(cfg), _of_toml(pyproject)
    if of_setup is None or of_cfg is None or of_toml is None or setup.call is None:
        return None
    configs = (of_setup, of_cfg, of_toml)
    roots = next((config.roots for config in configs if config.roots is not None), {})
    if not all(map(_is_within, roots.values())) or len(roots) > _MOST_ROOTS:
        return None
    if "packages" in setup.arguments:  # older setuptools do not read pyproject.toml
        return PackageLayout(roots, None if of_toml.packages else of_setup.packages)
    if not setup.whole or _HOOKS & setup.arguments.keys():
        return PackageLayout(roots, None)
    installed = [config.packages for config in configs if config.packages]
    if installed:
        is_certain = len(installed) == 1
        return PackageLayout(roots or _searched(installed[0]), installed[0] if is_certain else None)
    return _of_default_search(setup.place("packages"), roots, folders)


def _searched(installed: Installed) -> dict[str, str]:
    """Return the folder in which setuptools searches, as a value of `package_dir`."""
    wheres = [finder.where for finder in installed.finders if _is_within(finder.where)]
    return {"": wheres[0]} if wheres and normpath(wheres[0]) != "." else {}


def _of_default_search(
    place: Span, roots: Mapping[str, str], folders: Mapping[str, bool]
) -> PackageLayout:
    """Return the layout of a package that lists its packages nowhere."""
    if "src" in folders:
        return PackageLayout(roots or {"": "src"}, Installed(place, (), (Finder("src"),)))
    tops = {name for name in folders if "." not in name} - _NOT_FOUND
    if len(tops) > 1 and not roots:
        return PackageLayout(roots, Installed(place, is_nothing=True))
    return PackageLayout(roots, None)


#: The backend of a package that names none.
SETUPTOOLS = "setuptools.build_meta"


def build_backend(document: Mapping[str, Any]) -> str:
    """Return the build backend that a pyproject.toml names, or that its settings are for."""
    system, tool = document.get("build-system"), document.get("tool")
    backend = system.get("build-backend") if isinstance(system, dict) else None
    if isinstance(backend, str):
        return backend
    is_poetry = isinstance(tool, dict) and "poetry" in tool
    return "poetry.core.masonry.api" if is_poetry else SETUPTOOLS


def _is_within(root: str) -> bool:
    """Return whether a folder is within the package's."""
    return re.fullmatch(r"(?!/)[\w./ -]*", root) is not None and ".." not in root.split("/")


def _of_setup(setup: Setup) -> PackagingConfig | None:
    roots = None
    if "package_dir" in setup.arguments:
        pairs = setup.pairs(setup.arguments["package_dir"])
        roots = _texts({key: setup.text(value) for key, value in (pairs or {}).items()})
        if pairs is None or roots is None:
            return None
    if "packages" not in setup.arguments:
        return PackagingConfig(roots=roots)
    names, finders = [], []
    for part in setup.items(setup.arguments["packages"]):
        text = setup.text(part.node) if part.is_element else None
        finder = None if text else _finder(setup, part.node)
        if text:
            names.append(text)
        elif finder:
            finders.append(finder)
        else:
            return PackagingConfig(roots=roots)
    place = setup.place("packages")
    return PackagingConfig(Installed(place, tuple(names), tuple(finders)), roots)


def _finder(setup: Setup, node: ast.expr) -> Finder | None:
    """Return the search of a find_packages call; `None` if its arguments are computed."""
    call = setup.value(node)
    if not isinstance(call, ast.Call) or name_of_call(call) not in _FINDERS:
        return None
    arguments = dict(zip(("where", "exclude", "include"), call.args, strict=False))
    arguments |= {keyword.arg: keyword.value for keyword in call.keywords if keyword.arg}
    where = setup.text(arguments["where"]) if "where" in arguments else "."
    chosen = []
    for name in ("include", "exclude"):
        texts = setup.texts(arguments.get(name))
        if None in texts:
            return None
        chosen.append(tuple(text for text in texts if text is not None))
    return None if where is None else Finder(where, *chosen)


def _of_cfg(source: Source | None) -> PackagingConfig | None:
    if source is None:
        return PackagingConfig()
    try:
        cfg = SetupCfg(source.text)
    except ValueError:
        return None
    dirs = cfg.words("options", "package_dir") or cfg.words("options", "package-dir")
    pairs = [line.partition("=") for line in dirs]
    roots = {key.strip(): root.strip() for key, equals, root in pairs if equals} or None
    names = cfg.words("options", "packages")
    at = re.compile(r"(?mi)^packages\b").search(source.text, max(source.text.find("[options]"), 0))
    if not cfg.has("options", "packages") or at is None:
        return PackagingConfig(roots=roots)
    place = Span(source, *at.span())
    if names not in (("find:",), ("find_namespace:",)):
        return PackagingConfig(Installed(place, names), roots)
    section = "options.packages.find"
    where, include, exclude = (cfg.words(section, key) for key in _SEARCH)
    finder = Finder("".join(where) or ".", include, exclude)
    return None if len(where) > 1 else PackagingConfig(Installed(place, (), (finder,)), roots)


def _of_toml(source: Source | None) -> PackagingConfig | None:
    if source is None or "setuptools" not in source.text:
        return PackagingConfig()
    if len(source.text) > _MOST:
        return None
    try:
        table = toml(source.text).get("tool", {}).get("setuptools", {})
        roots = _texts(table.get("package-dir", {}))
        packages = table.get("packages")
        finder = packages.get("find", {}) if isinstance(packages, dict) else {}
        where = _all_texts(finder.get("where", ["."]))
        include, exclude = (_all_texts(finder.get(key, [])) for key in ("include", "exclude"))
        names = _all_texts([] if isinstance(packages, dict) else packages or [])
    except (ValueError, AttributeError, TypeError):
        return None
    if roots is None or len(where) != 1:
        return None
    if packages is None:
        return PackagingConfig(None, roots or None)
    at = re.search(r"\bpackages\b", source.text)
    place = Span(source, *(at.span() if at else (0, 0)))
    finders = (Finder(where[0], include, exclude),) if isinstance(packages, dict) else ()
    return PackagingConfig(Installed(place, names, finders), roots or None)


def _texts(table: Mapping[str, Any]) -> dict[str, str] | None:
    """Return the texts of a table, `None` if something in it is none."""
    texts = {key: value for key, value in table.items() if isinstance(value, str)}
    return texts if len(texts) == len(table) else None


def _all_texts(values: Iterable[Any]) -> tuple[str, ...]:
    texts = tuple(values)
    if isinstance(values, str) or not all(isinstance(text, str) for text in texts):
        raise TypeError
    return texts
