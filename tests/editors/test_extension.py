"""What the extensions say of idlc, which idlc says, too."""

import json
import re
import sys

import msgspec
import pytest
import yaml

from idlc.editor.workspace import EditorSettings
from idlc.model.ir import PRIMITIVES
from idlc.model.lowering.lower_types import STRINGS
from idlc.project.find import KINDS
from idlc.version import __version__
from tests.support.paths import DOCS, ROOT

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

FOLDER = ROOT / "editors" / "vscode"
MANIFEST = json.loads((FOLDER / "package.json").read_text(encoding="utf-8"))
CONTRIBUTED = MANIFEST["contributes"]
#: Settings that are the extension's own: which server is started, and what is logged of it.
OWN = {"path", "interpreter", "uvx", "installFrom", "trace.server"}


def test_the_version_is_that_of_idlc():
    assert MANIFEST["version"] == __version__


def test_the_language():
    (language,) = CONTRIBUTED["languages"]
    assert set(language["extensions"]) == set(KINDS)
    (grammar,) = CONTRIBUTED["grammars"]
    assert grammar["language"] == language["id"] == "rosmsg"
    assert grammar["scopeName"] == "source.rosmsg"


def test_the_settings_are_those_of_the_server():
    properties = CONTRIBUTED["configuration"]["properties"]
    given = {name.removeprefix("idlc."): value["default"] for name, value in properties.items()}
    taken = msgspec.to_builtins(EditorSettings())
    assert {name: value for name, value in given.items() if name not in OWN} == {
        name: list(value) if isinstance(value, tuple) else value for name, value in taken.items()
    }
    assert given.keys() >= OWN


def test_each_command_has_a_function():
    text = (FOLDER / "src" / "extension.ts").read_text(encoding="utf-8")
    (table,) = re.findall(r"const commands: .*? = \{\n(.*?)\n  \};", text, re.DOTALL)
    names = re.findall(r"^    (\w+): ", table, re.MULTILINE)
    assert [one["command"] for one in CONTRIBUTED["commands"]] == [f"idlc.{name}" for name in names]


def test_helix():
    """Helix is not in Debian: its documentation has the keys."""
    text = (ROOT / "editors/helix/languages.toml").read_text(encoding="utf-8")
    assert f"```toml\n{text}```\n" in (DOCS / "editors.md").read_text(encoding="utf-8")
    entry = tomllib.loads(text)
    (language,) = entry["language"]
    assert set(language["file-types"]) == {kind.removeprefix(".") for kind in KINDS}
    assert language["name"] == "rosmsg"
    assert language["language-servers"] == list(entry["language-server"]) == ["idlc"]
    assert entry["language-server"]["idlc"] == {"command": "rosidlc", "args": ["lsp"]}


def test_mason():
    """Its schema has these keys."""
    entry = yaml.safe_load((ROOT / "editors/mason/package.yaml").read_text(encoding="utf-8"))
    assert entry["name"] == entry["neovim"]["lspconfig"] == "idlc"
    assert entry["source"] == {"id": f"pkg:pypi/idlc@{__version__}"}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert entry["bin"].keys() <= project["scripts"].keys()
    assert entry["licenses"] == [project["license"]]


def test_emacs_has_the_version():
    text = (ROOT / "editors/emacs/rosmsg-mode.el").read_text(encoding="utf-8")
    assert f"\n;; Version: {__version__}\n" in text


@pytest.mark.parametrize(
    "path",
    ["vscode/syntaxes/rosmsg.tmLanguage.json", "neovim/syntax/rosmsg.vim", "kate/rosmsg.xml"],
)
def test_primitive_types_have_a_colour(path):
    text = (ROOT / "editors" / path).read_text(encoding="utf-8")
    pattern = re.search(r"bool\S*?\|byte.*?w\\?\?string", text)
    assert pattern
    words = re.sub(r"\\%\(|\\\||\\\)|\\\?", lambda one: VIM[one[0]], pattern[0])
    for name in (*PRIMITIVES, *STRINGS):
        assert re.fullmatch(words, name), name


#: What Vim writes with a backslash.
VIM = {"\\%(": "(?:", "\\|": "|", "\\)": ")", "\\?": "?"}


@pytest.mark.parametrize(
    "path", ["editors/vscode/package-lock.json", "tests/editors/vscode/package-lock.json"]
)
def test_locks_name_hashes_and_no_host(path):
    packages = json.loads((ROOT / path).read_text(encoding="utf-8"))["packages"]
    assert len(packages) > 50
    for name, one in packages.items():
        assert "resolved" not in one, name
        assert not name or one["integrity"].startswith("sha512-"), name
