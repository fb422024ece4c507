"""Packages that setup.cfg, pyproject.toml or setuptools itself choose, and those below src/."""

import re
import sys
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.scaffold.test_setup_shapes import FILES, PLAIN, built
from tests.support.files import write_all
from tests.support.programs import ended

NOTHING = PLAIN.replace("    packages=[package_name],\n", "")
FIND = NOTHING.replace("import setup", "import find_packages, setup")


PROJECT = '[project]\nname = "demo"\nversion = "0"\n'


def given(text):
    """Return a setup.py that gives setup() these arguments, too."""
    return FIND.replace("    version", f"    {text},\n    version")


def cfg(text):
    return {"setup.py": NOTHING, "setup.cfg": f"[metadata]\nname=demo\n[options]\n{text}\n"}


def toml(text):
    return {"setup.py": NOTHING, "pyproject.toml": f"{PROJECT}\n[tool.setuptools]\n{text}\n"}


SRC = "package_dir={'': 'src'}"
#: What files say, the folder of the package for each, and whether its classes are installed.
CASES = {
    "cfg: one": (cfg("packages = demo"), "demo", False),
    "cfg: some": (cfg("packages = demo, demo.msg"), "demo", False),
    "cfg: lines": (cfg("packages =\n    demo\n    # more\n    demo.msg"), "demo", False),
    "cfg: find": (cfg("packages = find:"), "demo", True),
    "cfg: namespaces": (cfg("packages = find_namespace:"), "demo", True),
    "cfg: exclude": (
        cfg("packages = find:\n[options.packages.find]\nexclude =\n    demo._idlc*"),
        "demo",
        False,
    ),
    "cfg: include": (
        cfg("packages = find:\n[options.packages.find]\ninclude = demo*"),
        "demo",
        True,
    ),
    "cfg: src": (
        cfg("package_dir =\n    = src\npackages = find:\n[options.packages.find]\nwhere = src"),
        "src/demo",
        True,
    ),
    "toml: one": (toml('packages = ["demo"]'), "demo", False),
    "toml: find": (toml("packages.find = {}"), "demo", True),
    "toml: include": (toml('packages.find = { include = ["demo"] }'), "demo", False),
    "toml: src": (toml('packages.find = { where = ["src"] }'), "src/demo", True),
    "toml: other src": (
        toml('package-dir = { "" = "src" }\npackages = ["demo"]'),
        "src/demo",
        False,
    ),
    "nothing": ({"setup.py": NOTHING}, "demo", False),
    "src alone": ({"setup.py": NOTHING}, "src/demo", True),
    "src": (
        {"setup.py": given(f"packages=find_packages('src'), {SRC}")},
        "src/demo",
        True,
    ),
    "src: one": ({"setup.py": given(f"packages=[package_name], {SRC}")}, "src/demo", False),
    "src: named": (
        {"setup.py": given("packages=['demo'], package_dir={'demo': 'src/demo'}")},
        "src/demo",
        False,
    ),
    "src: where": (
        {"setup.py": given(f"packages=find_packages(where='src', include=['demo']), {SRC}")},
        "src/demo",
        False,
    ),
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Return a function that writes the package of a case and goes there."""

    def write(name):
        files, home, is_whole = CASES[name]
        plain = {path.replace("demo/", f"{home}/"): text for path, text in FILES.items()}
        plain = {**plain, "resource/demo": "", **files}
        plain.pop("other/__init__.py")
        plain.pop(f"resource/{home}", None)
        plain["resource/demo"] = ""
        write_all({str(tmp_path / "demo" / path): text for path, text in plain.items()})
        monkeypatch.chdir(tmp_path / "demo")
        return home, is_whole

    return write


def codes(capsys):
    main(["check"])
    said = capsys.readouterr().out
    return {*re.findall(r"\[(IDL45[5-9]|IDL46\d)\]", said)}, said


@pytest.mark.parametrize("name", CASES)
def test_what_is_installed_is_told_from_every_file(name, package, capsys):
    home, is_whole = package(name)
    found, said = codes(capsys)
    assert ("IDL462" not in found) == is_whole, said
    assert main(["gen"]) == 0
    assert Path(home, "msg/__init__.py").is_file()
    assert sorted(path.parent for path in Path().rglob("idlc.lock")) == [Path(home)]
    capsys.readouterr()
    assert ("IDL462" not in codes(capsys)[0]) == is_whole
    main(["check", "--fix"])
    capsys.readouterr()
    found, said = codes(capsys)
    by_hand = name.startswith(("cfg", "toml")) or name == "src: named"
    assert is_whole or ("IDL462" in found) == by_hand, said


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_setuptools_installs_what_was_told(name, package, tmp_path):
    _, is_whole = package(name)
    assert main(["gen"]) == 0
    words = ("setup.py", "-q", "build", f"--build-lib={tmp_path / 'lib'}")
    ended(sys.executable, *words, cwd=Path.cwd())
    parts = ("msg", "srv", "action", "_idlc")
    there = all((tmp_path / "lib/demo" / part / "__init__.py").is_file() for part in parts)
    assert there == is_whole


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in CASES if "src" in name or name == "nothing"])
def test_what_was_fixed_is_built(name, package, tmp_path, capsys):
    package(name)
    main(["check", "--fix"])
    capsys.readouterr()
    found, said = codes(capsys)
    status, printed = built(Path.cwd(), tmp_path / "lib")
    # setup(idlc_interfaces=True) installs the classes wherever idlc builds, listed or not
    assert status == 0 or "IDL462" in found, said + printed
    assert status or (tmp_path / "lib/demo/msg/__init__.py").is_file()


def test_packages_below_src_are_fixed_there(package, capsys):
    package("src: one")
    main(["check", "--fix"])
    capsys.readouterr()
    assert codes(capsys)[0] == set()
    text = Path("setup.py").read_text(encoding="utf-8")
    packages = "        package_name,\n        *find_packages('src', include=['demo.*']),\n"
    assert f"    packages=[\n{packages}    ], package_dir=" in text


def test_interfaces_are_installed_from_where_they_lie(package, capsys):
    package("src")
    Path("msg").rename("src/demo/msg")
    main(["check", "--fix"])
    capsys.readouterr()
    assert codes(capsys)[0] == set()
    text = Path("setup.py").read_text(encoding="utf-8")
    assert "('share/demo/msg', glob('src/demo/msg/*.msg'))" in text
    assert "('share/demo/srv', glob('srv/*.srv'))" in text


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("pyproject.toml", "[tool.setuptools"),
        ("pyproject.toml", "[tool]\nsetuptools = 1"),
        ("pyproject.toml", "[tool.setuptools]\npackages = 1"),
        ("pyproject.toml", "[tool.setuptools]\npackages = [1]"),
        ("pyproject.toml", "[tool.setuptools.packages]\nfind = 1"),
        ("pyproject.toml", "[tool.setuptools]\npackages.find = { where = 'src' }"),
        ("pyproject.toml", "[tool.setuptools]\npackages.find = { where = ['a', 'b'] }"),
        ("pyproject.toml", "[tool.setuptools]\na = " + "[" * 5000),
        ("pyproject.toml", "[tool.setuptools]\na = " + "9" * 5000),
        ("pyproject.toml", "[tool.setuptools]\n" + ".".join("a" * 40_000) + " = 1"),
        ("setup.cfg", "[options]\npackages = find:\n[options.packages.find]\nwhere =\n  a\n  b"),
        ("setup.py", "from setuptools import setup\nsetup(name='demo', pbr=True)"),
        ("setup.py", "from setuptools import setup\nsetup(name='demo', **computed())"),
        ("setup.py", "from setuptools import setup\nsetup(name='demo', package_dir=computed())"),
    ],
)
def test_what_cannot_be_seen_is_not_judged(path, text, package, capsys):
    package("nothing")
    Path(path).write_text(text, encoding="utf-8")
    assert "IDL462" not in codes(capsys)[0]
