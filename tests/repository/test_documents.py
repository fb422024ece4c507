"""The reference documents say what is: commands, settings, the API of generated classes, links.

`IDLC_REFRESH=docs/command-line pytest tests/repository/test_documents.py` rewrites that page, and
fails.
"""

import json
import re
import shlex
import sys
from functools import partial
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.diagnostics.codes import CODES
from idlc.project.root import Root
from idlc.project.settings import Config
from idlc.project.step import digest
from idlc.versions.packages import Allowance
from tests.support import command_line_page, programs, refresh
from tests.support.files import write
from tests.support.paths import DOCS, ROOT

SETTINGS = (DOCS / "settings.md").read_text(encoding="utf-8")
API = (DOCS / "generated-api.md").read_text(encoding="utf-8")


# the command line


def test_the_commands_are_as_their_help_says():
    text = command_line_page.PAGE.read_text(encoding="utf-8")
    current = command_line_page.written(text)
    if refresh.wanted("docs/command-line"):
        command_line_page.PAGE.write_text(current, encoding="utf-8")
        refresh.refreshed()
    assert current == text


# a new version


def test_a_new_version_is_as_described(tmp_path, monkeypatch):
    """The commands run one after the other, for a package whose copy of the runtime is older."""
    text = (DOCS / "versioning.md").read_text(encoding="utf-8")
    write(tmp_path / "pyproject.toml", '[tool.idlc]\npaths = ["demo"]\nout = "out/demo"\n')
    write(tmp_path / "demo/package.xml", "<package><name>demo</name></package>\n")
    write(tmp_path / "demo/msg/Drive.msg", "float64 speed\n")
    monkeypatch.chdir(tmp_path)
    assert main(["gen"]) == 0
    older = b"# of an older idlc\n"
    for path in ("out/demo/_idlc/older.py", "out/demo/msg/_drive.py"):
        Path(path).write_bytes(older)
    lock = json.loads(Path("out/demo/idlc.lock").read_text(encoding="utf-8"))
    lock["outputs"] |= dict.fromkeys(["_idlc/older.py", "msg/_drive.py"], digest(older))
    write(tmp_path / "out/demo/idlc.lock", json.dumps(lock, indent=2, sort_keys=True) + "\n")
    for words in ("init -q", "add --all", "-c user.name=a -c user.email=a@b commit -qm old"):
        programs.run("git", *words.split(), cwd=tmp_path)
    shell = f"idlc() {{ '{sys.executable}' -m idlc \"$@\"; }}\nset -e\n"
    printed = [
        programs.run("sh", "-c", shell + block, cwd=tmp_path)
        for block in re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    ]
    assert "(up to date)" in printed[0]
    assert "msg/_drive.py" in printed[1]
    assert "_idlc/" not in printed[1]
    assert printed[2] == ""
    assert not Path("out/demo/_idlc/older.py").exists()


# settings


@pytest.fixture
def complaints(tmp_path, monkeypatch, capsys):
    """Return a function from the text of a pyproject.toml to what idlc says about it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".git").mkdir()
    (tmp_path / "demo" / "msg").mkdir(parents=True)
    (tmp_path / "demo" / "msg" / "Drive.msg").write_text("float64 speed\n", encoding="utf-8")

    def said(text: str) -> str:
        (tmp_path / "pyproject.toml").write_text(text, encoding="utf-8")
        main(["check", "demo"])
        main(["breaking", "demo"])
        printed = "".join(capsys.readouterr())
        return printed if "IDL611" in printed else ""

    return said


def table(name: str) -> dict[str, tuple[str, str]]:
    """Return the documented settings of a table: their types and defaults."""
    section = SETTINGS.partition(f"\n## [{name}]\n")[2].partition("\n## ")[0]
    row = re.compile(r"^\| `([a-z-]+)` \| ([^|]+) \| ([^|]*) \| .* \|.*\|$", re.MULTILINE)
    rows = row.findall(section)
    return {key: (type_, default) for key, type_, default in rows}


def test_the_examples_of_settings_are_right(complaints):
    examples = re.findall(r"```toml\n(.*?)```", SETTINGS, re.DOTALL)
    assert len(examples) == 3
    for example in examples:
        assert complaints(example) == ""


@pytest.mark.parametrize("name", re.findall(r"(?m)^## \[(.*)\]$", SETTINGS))
def test_these_are_the_settings(name, complaints):
    listed = re.search(r"the settings are (.*)\n", complaints(f"[{name}]\nqwertyuiop = 1\n"))
    assert listed is not None
    below = re.findall(rf"(?m)^## \[{name}\.(\w+)\]$", SETTINGS)
    assert set(re.findall(r"`([a-z-]+)`", listed[1])) == {*table(name), *below}
    for key, (type_, _) in table(name).items():
        assert f"`{key}` in [{name}] must be {type_}" in complaints(f"[{name}]\n{key} = 1.5\n")


def test_the_defaults_of_settings():
    for key, (_, default) in table("tool.idlc").items():
        value = getattr(Config(root=Root.here()), key.replace("-", "_"))
        assert default == ("false" if value is False else "none")
        assert not value
    (listed,) = re.findall(r"These rules are off by\s+default: (.*?)\.\n", SETTINGS, re.DOTALL)
    assert set(re.findall(r"IDL\d+", listed)) == {
        code.id for code in CODES.values() if not code.default
    }


def test_the_keys_of_an_allowance():
    keys = re.findall(r"^\| `(\w+)` \| [^|]+ \| [^|]+ \|$", SETTINGS, re.MULTILINE)
    assert keys == ["at", "reason", "until", "code"]
    assert set(keys) == set(Allowance.__struct_fields__)


def test_the_variables_of_the_environment():
    read = re.compile(r"environ(?:\.get\(|\[)\"([A-Z_]+)\"")
    found = {
        name
        for path in (ROOT / "idlc").rglob("*.py")
        for name in read.findall(path.read_text(encoding="utf-8"))
        if not path.name.startswith("typesupport")
    }
    listed = SETTINGS.partition("\n## Environment variables\n")[2]
    assert found == set(re.findall(r"`([A-Z_]{3,})`", listed))


# the API of generated classes


@pytest.fixture(scope="module")
def generated(tmp_path_factory) -> Path:
    """Return the folder in which the files of docs/generated-api.md were compiled."""
    folder = tmp_path_factory.mktemp("api")
    files = re.findall(r"^```(demo_msgs/\S+)\n(.*?)^```$", API, re.MULTILINE | re.DOTALL)
    assert len(files) == 4
    for path, text in files:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    (line,) = re.findall(r"^idlc (gen .*)$", API, re.MULTILINE)
    programs.run(sys.executable, "-m", "idlc", *line.split(), cwd=folder)
    return folder / "out"


def test_the_examples_of_the_api(generated):
    blocks = re.findall(r"^```python\n(.*?)^```$", API, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 8
    programs.run(sys.executable, "-c", "\n".join(blocks), cwd=generated)


def test_every_public_name_is_documented(generated):
    """What a class offers is on the page, or in the examples' own files."""
    code = (
        "from demo_msgs.msg import Drive\n"
        "from demo_msgs.srv import Add\n"
        "from demo_msgs.action import Count\n"
        "for kind in (Drive, Add, Count, Count.Impl):\n"
        "    print(*(name for name in dir(kind) if name[0] != '_'))\n"
    )
    names = set(programs.run(sys.executable, "-c", code, cwd=generated).split())
    assert len(names) > 20
    assert {name for name in names if not re.search(rf"\b{name}\b", API)} == set()


# links and names


def anchors(path: Path) -> set[str]:
    """Return what GitHub calls the headings of a document."""
    heads = re.findall(r"(?m)^#+ (.*)$", path.read_text(encoding="utf-8"))
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def links(path: Path) -> list[str]:
    """Return what the text of a document, which is not code, links to."""
    text = path.read_text(encoding="utf-8")
    text = re.sub(r"^(```+).*?^\1$|`[^`\n]+`", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.findall(r"\]\(([^)\s]+)\)", text)


PAGES = [ROOT / "README.md", ROOT / "SECURITY.md", *sorted(DOCS.rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_links_lead_somewhere(page):
    for target in links(page):
        path, _, anchor = target.partition("#")
        if ":" not in path:
            there = (page.parent / path).resolve() if path else page
            assert there.exists(), target
            assert not anchor or anchor in anchors(there), target


def test_the_index_lists_every_page():
    linked = {(DOCS / link.partition("#")[0]).resolve() for link in links(DOCS / "index.md")}
    assert set(DOCS.rglob("*.md")) - {DOCS / "index.md"} <= linked


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted(DOCS.glob("*.md"))], ids=lambda p: p.name
)
def test_commands_can_be_pasted_into_zsh(page):
    """The shell of macOS reads a comment as arguments: `#` is a word like any other."""
    text = page.read_text(encoding="utf-8")
    for block in re.findall(r"^ *```sh\n(.*?)^ *```$", text, re.DOTALL | re.MULTILINE):
        assert not [word for word in shlex.split(block) if word.startswith("#")], block


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="not in a repository")
def test_what_is_generated_is_marked():
    git = partial(programs.run, "git", cwd=ROOT)
    paths = git("ls-files", "examples", "golden", "idlc", "templates").splitlines()
    marks = git("check-attr", "linguist-generated", "--", *paths).splitlines()
    marked = {line.split(": ")[0] for line in marks if line.endswith(": set")}
    generated = {path for path in paths if "/_idlc/" in path or path.endswith("/idlc.lock")}
    assert len(generated) > 15
    assert generated <= marked
    assert not any(path.startswith(("idlc/", "templates/")) for path in marked)
