"""Text from interface files stays text: in Python, in templates, in a terminal, in a shell."""

import ast
import json
import os
import subprocess
import sys
import unicodedata
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.support import generated
from tests.support.hostile import (
    OTHER_LINE_ENDS,
    PAYLOADS,
    assert_harmless,
    assert_untouched,
    on_a_terminal,
    run,
)
from tests.support.tools import tool


@pytest.fixture(autouse=True, scope="module")
def colourful():
    """Let idlc colour what it says, as on a terminal."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FORCE_COLOR", "1")
        patch.delenv("NO_COLOR", raising=False)
        yield


#: Where a payload may stand in a file that is accepted; `{}` is the payload.
PLACES = {
    "head": "# {}\n\nint8 a\n",
    "comment": "int8 a  # {}\n",
    "below": "int8 a  # x\n        # {}\n",
    "unit": "int8 a  # x [{}]\n",
    "constant": "string TEXT={}\nint8 a\n",
    "constant comment": "# {}\nint8 ONE=1  # [{}]\nint8 a\n",
    "quoted constant": "string TEXT='{}'\nint8 a\n",
    "wide constant": 'wstring TEXT="{}"\nint8 a\n',
    "default": "string a {}\n",
    "quoted default": 'string a "{}"\n',
    "array": "string[] a [\"{}\", '{}']\n",
}
#: What rosidl refuses wherever it stands: backslashes that swallow what closes the text.
REFUSED = {"backslash", "backslashes"}
#: What stands there in the package that all others must look like.
HARMLESS = "x"

READ = """
import importlib, json, sys
found = {}
for module, name in json.load(sys.stdin):
    cls = getattr(importlib.import_module(module), name)
    message = cls()
    repr(message), message.serialize(), cls.deserialize(message.serialize())
    message.validate(), message.to_dict(), cls.__dataclass_fields__
    text = getattr(cls, "TEXT", None)
    found[name] = [cls.__doc__, text, message.a if not isinstance(message.a, int) else None]
json.dump(found, sys.stdout)
"""


def names_of(place, payload):
    """Return the names of the attacked message and of its harmless twin."""
    number = list(PLACES).index(place) * 1000 + list(PAYLOADS).index(payload)
    return f"Attack{number}", f"Twin{number}"


@pytest.fixture(scope="module")
def attacked(tmp_path_factory):
    """One package of every payload at every place where idlc accepts it, generated and used."""
    folder = tmp_path_factory.mktemp("attack")
    (folder / ".git").mkdir()
    msg = folder / "pkg" / "msg"
    msg.mkdir(parents=True)
    for place, text in PLACES.items():
        for payload, attack in PAYLOADS.items():
            name, _ = names_of(place, payload)
            (msg / f"{name}.msg").write_text(text.replace("{}", attack), encoding="utf-8")
    checked = run(["check", "pkg", "--format", "json"], folder)
    refused = {
        found["path"]: found["code"]
        for line in checked.stdout.splitlines()
        if (found := json.loads(line)).get("severity") == "error"
    }
    for path in refused:
        (folder / path).unlink()
    accepted = sorted(path.stem for path in msg.iterdir())
    for place, text in PLACES.items():
        for payload in PAYLOADS:
            name, twin = names_of(place, payload)
            if name in accepted:
                (msg / f"{twin}.msg").write_text(text.replace("{}", HARMLESS), encoding="utf-8")
    done = run(["gen", "pkg", "-o", "out/attack"], folder)
    assert done.status == 0, done.stderr
    used = subprocess.run(
        [sys.executable, "-c", READ],
        cwd=folder / "out",
        input=json.dumps([("attack.msg", name) for name in accepted]),
        env={**os.environ, "PYTHONUTF8": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert used.returncode == 0, used.stderr
    return folder, checked, done, json.loads(used.stdout), refused


def test_nothing_ran_and_nothing_was_forged(attacked):
    folder, checked, done, _, _ = attacked
    assert_untouched(folder)
    assert_harmless(done.stdout + done.stderr)
    for line in checked.stdout.splitlines():
        assert line.isascii()
        assert json.loads(line)["type"] in ("diagnostic", "summary")


@pytest.mark.parametrize("place", PLACES)
def test_most_payloads_are_accepted_where_they_stand(place, attacked):
    # what is refused is refused as rosidl does: because of its backslashes, quotes or brackets
    accepted = [payload for payload in PAYLOADS if names_of(place, payload)[0] in attacked[3]]
    assert len(accepted) > len(PAYLOADS) / 2


@pytest.mark.parametrize("payload", PAYLOADS)
def test_no_payload_adds_anything_to_the_program(payload, attacked):
    folder, _, _, used, _ = attacked
    looked_at = 0
    for place in PLACES:
        name, twin = names_of(place, payload)
        if name in used:
            (attack, statements), (harmless, as_many) = (
                vocabulary(folder / "out/attack/msg", name) for name in (name, twin)
            )
            # a long default is laid out in a statement where a short one is an expression
            assert attack <= harmless | {"If"}, place
            assert statements == as_many, place
            looked_at += 1
    assert looked_at or payload in REFUSED


def vocabulary(folder: Path, name: str) -> tuple[set[str], int]:
    """Return a module's identifiers and kinds of syntax, and the number of its statements."""
    text = (folder / f"_{name.lower()}.py").read_text(encoding="utf-8")
    tree = ast.parse(text.replace(name, "Name").replace(name.lower(), "name"))
    words = set()
    for node in ast.walk(tree):
        words.add(type(node).__name__)
        for field in ("id", "attr", "arg", "name", "asname", "module"):
            words |= {str(getattr(node, field, ""))}
    return words, len(tree.body)


@pytest.mark.parametrize("payload", PAYLOADS)
def test_values_arrive_as_they_were_written(payload, attacked):
    used = attacked[3]
    attack = PAYLOADS[payload]
    # backslashes and quotes are interpreted as rosidl does, which tests of the language hold
    if set(attack) & set("\\\"'#=[],"):
        return
    for place in ("constant", "quoted constant", "wide constant"):
        assert used[names_of(place, payload)[0]][1] == attack
    for place in ("default", "quoted default"):
        assert used[names_of(place, payload)[0]][2] == attack
    # rosidl cannot write characters beyond U+00FF in an array
    if ord(max(attack)) <= 0xFF:
        assert used[names_of("array", payload)[0]][2] == [attack, attack]


@pytest.mark.parametrize("payload", PAYLOADS)
def test_the_source_text_for_type_descriptions_is_the_files(payload, attacked):
    folder, _, _, used, _ = attacked
    types = generated.type_data(folder / "out/attack")
    for place in PLACES:
        name, _ = names_of(place, payload)
        if name in used:
            text = (folder / f"pkg/msg/{name}.msg").read_text(encoding="utf-8")
            assert types["sources"][f"attack/msg/{name}"] == text


BROKEN = [
    "{}",
    "int8 {}",
    "int8 a {}",
    "int8[{}] a",
    "string<={} a",
    "int8 {}=1",
    "int8 A={}",
    "{}/Pose a",
    "geometry_msgs/{} a",
    "string<=1 a {}",
    "string A='{}",
]


@pytest.mark.parametrize("style", ["text", "json"])
def test_what_is_wrong_is_shown_without_harm(style, tmp_path):
    msg = write_broken(tmp_path)
    for path in sorted(msg.iterdir()) if style == "text" else [msg]:
        done = run(["check", str(path.relative_to(tmp_path)), "--format", style], tmp_path)
        assert done.status == 1
        assert done.stderr == ""
        assert_harmless(done.stdout)
        if style == "json":
            for line in done.stdout.splitlines():
                assert json.loads(line)["type"] in ("diagnostic", "summary")
    assert_untouched(tmp_path)


def write_broken(folder: Path) -> Path:
    (folder / ".git").mkdir()
    msg = folder / "pkg" / "msg"
    msg.mkdir(parents=True)
    for number, attack in enumerate((*PAYLOADS.values(), *OTHER_LINE_ENDS)):
        lines = "".join(line.replace("{}", attack) + "\n" for line in BROKEN)
        (msg / f"B{number}.msg").write_text(lines, encoding="utf-8")
    for name, path in FILE_NAMES.items():
        if name != "not utf-8":
            (msg / f"{path}.msg").write_text("int8 A\n", encoding="utf-8")
    return msg


@pytest.mark.parametrize("style", ["github", "sarif", "junit", "gitlab"])
def test_reports_for_ci_systems_cannot_be_forged(style, tmp_path):
    msg = write_broken(tmp_path)
    errors = 0
    for line in run(["check", "pkg", "--format", "json"], tmp_path).stdout.splitlines():
        errors += json.loads(line)["type"] == "diagnostic"
    found = run(["check", "pkg", "--format", style], tmp_path)
    assert found.status == 1
    hidden = {c for c in found.stdout if c != "\n" and unicodedata.category(c) in ("Cc", "Cf")}
    assert not hidden
    if style == "github":
        lines = found.stdout.splitlines()
        assert {line.partition(" ")[0] for line in lines if line.startswith("::")} <= {
            "::error",
            "::warning",
            "::notice",
        }
        assert sum(line.startswith("::") for line in lines) == errors
        assert not [line for line in lines if line.startswith(("##[", "forged", "error[IDL999]"))]
    elif style == "junit":
        tags = [element.tag for element in ElementTree.fromstring(found.stdout).iter()]  # noqa: S314
        assert set(tags) == {"testsuite", "testcase", "failure", "system-out"}
        assert tags.count("failure") + tags.count("system-out") == errors  # the latter warn
        assert "\nerror[IDL999]" not in found.stdout
    else:
        text = json.dumps(json.loads(found.stdout))
        assert '"IDL999"' not in text
    assert_untouched(msg)


FILE_NAMES = {
    name: payload.replace("/", "|").replace("\0", "")[:60]
    for name, payload in PAYLOADS.items()
    if name not in ("private", "combining")
} | {"line end": "A\nerror[IDL999]: forged", "carriage return": "A\rforged", "not utf-8": "a\udcff"}


@pytest.mark.parametrize("position", ["file", "folder", "out", "include"])
def test_names_of_files_and_folders_are_shown_without_harm(position, tmp_path):
    (tmp_path / ".git").mkdir()
    for number, name in enumerate(FILE_NAMES.values()):
        here = tmp_path / str(number)
        folder = here / name if position == "folder" else here / "pkg"
        file = f"{name}.msg" if position == "file" else "A.msg"
        (folder / "msg").mkdir(parents=True)
        (folder / "msg" / file).write_text("int8  a  # x\n", encoding="utf-8")
    for words in commands(position):
        for number, name in enumerate(FILE_NAMES.values()):
            done = run([word.replace("{}", name) for word in words], tmp_path / str(number))
            assert_harmless(done.stdout + done.stderr)
    assert_untouched(*(path for path in tmp_path.iterdir() if path.name.isdigit()))


def commands(position):
    """Return command lines; `{}` is the hostile name."""
    if position == "out":
        return [["gen", "pkg", "-o", "{}", "--package", "demo"], ["gen", "pkg", "-o", "{}"]]
    if position == "include":
        return [["check", "pkg", "-I", "{}"], ["gen", "{}.msg", "-o", "out"]]
    paths = "./{}" if position == "folder" else "pkg"
    return [
        ["check", paths],
        ["fmt", "--check", paths],
        ["fmt", paths],
        ["gen", paths, "-o", "out/demo"],
        ["show", paths, "--format", "hash"],
        ["breaking", paths, "--against", paths],
    ]


@pytest.mark.parametrize("payload", ["terminal colour", "terminal, 8 bit", "right to left", "nul"])
def test_a_difference_on_a_terminal_is_harmless(payload, tmp_path):
    (tmp_path / "A.msg").write_text(f"int8   a # {PAYLOADS[payload]}\n", encoding="utf-8")
    said = on_a_terminal(["fmt", "--diff", "A.msg"], tmp_path)
    assert "int8 a" in said
    assert_harmless(said)


XML = "<?xml version='1.0'?>\n{}<package><name>{}</name></package>\n"


@pytest.mark.parametrize(
    ("doctype", "name"),
    [
        ("<!DOCTYPE p [<!ENTITY x SYSTEM 'file://{secret}'>]>", "a&x;"),
        ("<!DOCTYPE p [<!ENTITY % x SYSTEM 'file://{secret}'> %x;]>", "a"),
        ("<!DOCTYPE p SYSTEM 'file://{secret}'>", "a&x;"),
        ("", "\x1b[31m"),
        ("", "&#27;[31mforged"),
        ("", "$(touch CANARY)"),
        ("", "a'; touch CANARY; '"),
        ("", "../../evil"),
        ("", "--help"),
        ("", "a\nerror[IDL999]: forged"),
    ],
)
def test_a_package_xml_neither_reads_files_nor_forges(doctype, name, tmp_path):
    (tmp_path / ".git").mkdir()
    secret = tmp_path / "secret"
    secret.write_text("topsecret", encoding="utf-8")
    text = XML.format(doctype.replace("{secret}", str(secret)), name)
    (tmp_path / "package.xml").write_text(text, encoding="utf-8")
    (tmp_path / "msg").mkdir()
    (tmp_path / "msg/A.msg").write_text("int8 a\n", encoding="utf-8")
    before = {path for path in tmp_path.rglob("*") if path.name != "out"}
    for words in (
        ["check", "."],
        ["gen", ".", "-o", "out/demo"],
        ["breaking", ".", "--against", "."],
    ):
        done = run(words, tmp_path)
        assert "topsecret" not in done.stdout + done.stderr
        assert_harmless(done.stdout + done.stderr)
    assert before >= {p for p in tmp_path.rglob("*") if "out" not in p.relative_to(tmp_path).parts}
    assert_untouched(tmp_path)


@pytest.mark.parametrize("kind", ["entities", "attributes", "nesting"])
def test_an_xml_bomb_ends(kind, tmp_path):
    entities = "".join(f"<!ENTITY e{i} '{f'&e{i - 1};' * 10}'>" for i in range(1, 20))
    attributes = " ".join(f"a{i}=''" for i in range(20000))
    named = "<package><name>{}</name></package>"
    text = {
        "entities": f"<!DOCTYPE p [<!ENTITY e0 'x'>{entities}]>{named.format('&e19;')}",
        "attributes": f"<p {attributes}/>",
        "nesting": "<package>" + "<a>" * 20000 + "</a>" * 20000 + "<name>a</name></package>",
    }[kind]
    (tmp_path / "package.xml").write_text(text, encoding="utf-8")
    (tmp_path / "A.msg").write_text("int8 a\n", encoding="utf-8")
    done = run(["check", "."], tmp_path)
    assert len(done.stdout) < 2000
    assert ("IDL610" in done.stdout) == (kind != "nesting")


SETTINGS = [
    'out = "\\u001b[31mforged"',
    '"\\u001b[31mforged" = 1',
    'package = "x\\nerror[IDL999]: forged"',
    'paths = ["$(touch CANARY)"]',
    'include = ["; touch CANARY"]',
    'out = "../../evil"\npackage="../evil"',
    "out = '''\n::error::forged'''",
    "breaking = {against = 'git:--output=CANARY'}",
    "breaking = {against = 'git:HEAD --output=CANARY'}",
    'breaking = {allow = [{at = "\\u001b[31m", reason = "\\u001b[31m"}]}',
]


@pytest.mark.parametrize("setting", SETTINGS)
def test_settings_are_shown_without_harm(setting, tmp_path):
    (tmp_path / "a/b/msg").mkdir(parents=True)
    subprocess.run([tool("git"), "init", "-q", str(tmp_path)], check=True)
    here = tmp_path / "a/b"
    (here / "pyproject.toml").write_text(f"[tool.idlc]\n{setting}\n", encoding="utf-8")
    (here / "msg/A.msg").write_text("int8 a\n", encoding="utf-8")
    for words in (["check"], ["gen", "."], ["breaking"], ["breaking", "--against", "git:HEAD"]):
        done = run(words, here)
        assert_harmless(done.stdout + done.stderr)
    assert_untouched(tmp_path)


REVISIONS = ["--output=CANARY", "-c", "HEAD;touch CANARY", "$(touch CANARY)", "\x1b[31mforged"]
REVISIONS += ["a\nforged", "HEAD:msg", "@{-1}", ":/x", "HEAD^{tree}", "../..", ""]


@pytest.mark.parametrize("name", REVISIONS)
def test_a_revision_is_only_a_revision(name, tmp_path):
    git = [tool("git"), "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@example.org"]
    (tmp_path / "msg").mkdir()
    (tmp_path / "msg/A.msg").write_text("int8 a\n", encoding="utf-8")
    for words in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "x"]):
        subprocess.run([*git, *words], check=True)
    done = run(["breaking", ".", "--against", f"git:{name}"], tmp_path)
    assert done.status == 2
    assert_harmless(done.stdout + done.stderr)
    assert_untouched(tmp_path)
