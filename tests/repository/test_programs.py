"""What idlc, its action and its editors' extensions start and import, and what SECURITY.md says."""

import ast
import json
import re
from collections.abc import Iterator

import pytest

from idlc.cli.main import main
from tests.support.files import write
from tests.support.paths import ROOT

TEXT = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
TITLE = "\n## Programs that idlc starts, and modules that it imports\n"
PART = TEXT.partition(TITLE)[2].partition("\n## ")[0]
#: Modules that start programs, or import by names.
STARTING = {"asyncio", "concurrent", "importlib", "multiprocessing", "pty", "runpy", "subprocess"}
#: These of them give data, or forget it.
HARMLESS = {"importlib.resources", "importlib.metadata"}
CALLS = {"__import__", "compile", "eval", "exec"}
ATTRIBUTES = re.compile(
    r"(os\.(exec|fork|popen|posix_spawn|spawn|startfile|system)|shutil\.which|ctypes\.(CDLL|PyDLL)"
    r"|code\.interact|webbrowser\.|\w+\.exec_module|\w+\.load_module|\w+\.LoadLibrary)"
)


def uses(tree: ast.AST) -> Iterator[str]:
    """Yield what of a module may start a program, or import what its text does not name."""
    for node in ast.walk(tree):
        match node:
            case ast.Import():
                names = [one.name for one in node.names]
                yield from (name for name in names if name.split(".")[0] in STARTING)
            case ast.ImportFrom(module=str(name), level=0):
                if name.split(".")[0] in STARTING and name not in HARMLESS:
                    yield name
            case ast.Call(func=ast.Name(id=name)) if name in CALLS:
                yield name
            case ast.Attribute() if ATTRIBUTES.match(ast.unparse(node)):
                yield ast.unparse(node)


def test_every_start_and_import_by_name_is_in_the_table():
    found = {
        path.relative_to(ROOT).as_posix(): sorted(set(uses(ast.parse(path.read_text("utf-8")))))
        for path in (ROOT / "idlc").rglob("*.py")
    }
    listed = re.findall(r"`(idlc/[\w/]+\.py)`", PART.partition("\nThis test compares")[0])
    assert len(listed) == len(set(listed))
    assert {path: some for path, some in found.items() if some}.keys() == set(listed)


@pytest.mark.parametrize(
    "text",
    [
        "import subprocess",
        "from importlib import import_module",
        "os.execvp(a, b)",
        "def f():\n import runpy",
        "exec(x)",
        "ctypes.CDLL(None)",
    ],
)
def test_the_search_sees(text):
    assert list(uses(ast.parse(text)))


def test_the_extension_starts_what_is_said():
    """Whoever lets it start something else has to say so in SECURITY.md."""
    folder = ROOT / "editors/vscode"
    manifest = json.loads((folder / "package.json").read_text("utf-8"))
    assert manifest["capabilities"]["untrustedWorkspaces"]["supported"] == "limited"
    source = "".join(path.read_text("utf-8") for path in sorted((folder / "src").glob("*.ts")))
    starts = re.findall(r"\b(?:run|ProcessExecution|LanguageClient)\(.*", source)
    assert len(starts) == 4
    assert {re.sub(r".*\b(cwd|folder)\b.*", "a folder", one) for one in starts} <= {
        "a folder",
        'LanguageClient("idlc", "idlc", options, {',
    }
    assert "options: { cwd: this.folder }" in source
    assert source.count("...SAFE") + source.count("env: SAFE") == 2
    assert not re.search(r"\b(spawn|fork|exec|ShellExecution|sendText|eval)\(", source)


def test_editors_start_the_command_and_not_python_m():
    """`python -m` imports from the working folder, which an editor may have set to a workspace."""
    texts = [(ROOT / "docs/editors.md").read_text("utf-8")]
    texts += [path.read_text("utf-8") for path in (ROOT / "editors/neovim").rglob("*.lua")]
    assert all("-m idlc" not in text and "'-m'" not in text for text in texts)


@pytest.mark.parametrize("words", [["breaking"], ["check"], ["gen"]])
def test_urls_of_settings_are_not_opened(words, here, monkeypatch, capsys):
    write("msg/A.msg", "int8 a\n")
    url = "simplecache::https://localhost/a.mcap"
    write("pyproject.toml", f"tool.idlc.paths = ['{url}']\ntool.idlc.breaking.against = '{url}'\n")
    monkeypatch.setattr("idlc.recordings.containers.source.FileSource", None)
    assert main([*words]) == 2
    said = "".join(capsys.readouterr())
    assert "IDL611" in said
    assert "is a URL" in said
    assert here
