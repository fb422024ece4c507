"""docs/language.md is true: its examples, its tables, and the sections that others cite.

`IDLC_REFRESH=docs/language pytest tests/language/test_language.py` writes the arrows anew, and
fails.
"""

import json
import re

from idlc.diagnostics.codes import CODES
from idlc.model import derive, ir
from idlc.model.describe import individual
from idlc.model.idl_text import idl
from idlc.model.names import snake_case
from tests.support import language_book, refresh, rosidl_view
from tests.support.generated import model_of
from tests.support.paths import ROOT

TEXT = language_book.BOOK.read_text(encoding="utf-8")
HEADINGS = set(re.findall(r"^##+ (\d+(?:\.\d+)?)\.? ", TEXT, re.MULTILINE))
#: `language 2.3` or `language 3 and 4`, in comments and docstrings.
CITED = re.compile(r"\blanguage (\d[\d.]*\d|\d)((?:(?:,| and) (?:\d[\d.]*\d|\d))*)")
CITING = ("idlc", "tests", "templates", "docs", "benchmarks")


def table(head: str) -> list[list[str]]:
    """Return the rows of the table whose first line begins so, without the marks of code."""
    lines = TEXT.partition(f"\n| {head} |")[2].partition("\n\n")[0].splitlines()[2:]
    assert lines, head
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def code(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def test_examples_mean_what_they_say():
    found = {
        example.place: language_book.told_by_idlc(example)
        for example in language_book.examples(TEXT)
    }
    assert len(found) > 200
    text = language_book.rewritten(TEXT, found)
    if refresh.wanted("docs/language"):
        language_book.BOOK.write_text(text, encoding="utf-8")
        refresh.refreshed()
    assert text == TEXT


def test_the_idl_file():
    example, shown = language_book.idl_shown(TEXT)
    model, _ = rosidl_view.compile_case(example.case)
    written = idl(model.interfaces[ir.TypeName("demo", "msg", "Example")])
    assert language_book.idl_text(written) == shown


def test_bytes_are_the_recorded_ones():
    """What idlc writes is held to the same records by test_emit_rosidl."""
    lines = (ROOT / "golden/rosidl/cdr.jsonl").read_text(encoding="utf-8").splitlines()
    known = {
        (record["definition"], json.dumps(record["value"], sort_keys=True), record["hex"])
        for record in map(json.loads, lines)
    }
    blocks = re.findall(r"^```cdr\n((?:\w.*\n)+)(\{.*\})\n→ (.*)\n```$", TEXT, re.MULTILINE)
    assert len(blocks) == TEXT.count("```cdr\n") > 5
    for definition, value, shown in blocks:
        data = re.sub(r"[ |]", "", shown)
        assert (definition, json.dumps(json.loads(value), sort_keys=True), data) in known


def test_the_table_of_types():
    rows = [row for row in table("type") if not row[0].startswith("`Name`")]
    for names, _, spelled, *_, ids in rows:
        texts = [name.replace("N", "9") for name in code(names)]
        for text, id_ in zip(texts, ids.split(", "), strict=True):
            message = one_field(text)
            shown = rosidl_view.parsed(message)[0]["members"][0]["type"]
            assert individual(message)["fields"][0]["type"]["type_id"] == int(id_)
            same = "…" in spelled or spelled == "the same" or shown in code(spelled)
            assert same, (text, shown)


def one_field(type_: str) -> ir.Message:
    files = {"msg/Part.msg": "int32 a\n", "msg/Example.msg": f"{type_} a\n"}
    model = model_of("demo", files)
    return model.interfaces[ir.TypeName("demo", "msg", "Example")]


def test_ids_of_arrays():
    shown = TEXT.partition("### 6.1")[2].partition("### 6.2")[0]
    found = re.findall(r"`(\S+)`\s(?:is )?(\d+)[,.]", shown)
    assert len(found) == 3
    for type_, id_ in found:
        assert individual(one_field(type_))["fields"][0]["type"]["type_id"] == int(id_)


def test_the_table_of_modules():
    for interface, module in table("interface"):
        assert code(module) == ["_" + snake_case(code(interface)[0])]


def test_what_services_and_actions_imply():
    files = {"srv/X.srv": "---\n", "action/A.action": "---\n---\n"}
    model = model_of("demo", files)
    known = {
        structure.name.name: {field.name: spelled(field.type) for field in structure.fields}
        for name in ("srv/X", "action/A")
        for interface in [model.interfaces[ir.TypeName.parse(f"demo/{name}")]]
        for structure in derive.structures(interface)
    }
    rows = TEXT.partition("A service `X` and an action `A` become:")[2].partition(
        "Only for hashing"
    )[0]
    rows += TEXT.partition("Only for hashing")[2].partition("Your own fields")[0]
    told = {
        name: re.findall(r"`(\S+) (\w+)`", cells)
        for names, cells in re.findall(r"^\| (`.*`) \| (.*) \|$", rows, re.MULTILINE)
        for name in code(names)
    }
    events = {name for name in known if name.endswith("_Event")}
    # services of actions have a structure for hashing of their own, as any service
    assert told.keys() == known.keys() - {"A_SendGoal", "A_GetResult"}
    for name, fields in told.items():
        if fields:
            expected = {field: type_.replace("demo/", "") for field, type_ in known[name].items()}
            assert {field: type_ for type_, field in fields} == expected
    assert {"X_Event", "A_SendGoal_Event", "A_GetResult_Event"} == events


def spelled(type_: ir.FieldType) -> str:
    if isinstance(type_, ir.Sequence):
        return f"{spelled(type_.element)}[<={type_.bound}]"
    if isinstance(type_, ir.Primitive):
        return type_.name
    own = type_.target.package == "demo"
    return type_.target.name if own else str(type_.target)


def test_the_table_of_reserved_words():
    """idlc's warnings are held to what was compiled by test_spec_cases."""
    for words, *fails in table("a field named"):
        for word in code(words):
            text = f"int32 {word}\nint32 other\n"
            example = language_book.Example("", text, (), "msg")
            warned = " ".join(language_book.told_by_idlc(example))
            python, c, cpp = (cell.endswith("fails") for cell in fails)
            assert python == ("IDL220" in warned), word
            assert c == ("IDL221" in warned), word
            # what is said to break C needs not be said to break C++ as well
            assert c or cpp == ("IDL222" in warned), word


def test_every_rule_of_the_language_is_in_it():
    rules = {code for code in CODES if code[3] in "123"}
    assert {code for code in rules if code not in TEXT} == set()


def test_codes_are_called_so():
    for id_, slug in re.findall(r"\b(IDL\d{3})(?: ([a-z]+(?:-[a-z0-9]+)+))?", TEXT):
        assert id_ in CODES
        assert slug in ("", CODES[id_].slug)


def test_citations_lead_to_headings():
    assert {"1.5", "2", "8.6"} <= HEADINGS
    cited = {}
    for folder in CITING:
        for path in (ROOT / folder).rglob("*"):
            if path.suffix not in {".py", ".md", ".jinja", ".lark"}:
                continue
            text = path.read_text(encoding="utf-8")
            for first, more in CITED.findall(text):
                for section in (first, *re.findall(r"[\d.]*\d", more)):
                    cited.setdefault(section, path)
            assert not re.search(r"\bspec (?:section )?\d", text), path
    sections = re.findall(r"\b[Ss]ections? (\d[\d.]*\d|\d)", TEXT)
    assert len(cited) > 10
    assert {*cited, *sections} <= HEADINGS, cited
