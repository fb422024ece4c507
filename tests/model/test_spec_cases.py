"""Verdict, meaning and hash are rosidl's, on every recorded case."""

import json

import pytest

from idlc.diagnostics.report import Report, Severity
from idlc.language.parse import parse
from idlc.model import catalog, ir
from idlc.model.link import link
from idlc.model.lowering.lower import lower
from tests.support import rosidl_view
from tests.support.paths import SPEC


def records(name):
    return [json.loads(line) for line in (SPEC / name).read_text("utf-8").splitlines()]


CASES = [*records("accept_reject.jsonl"), *records("found_live.jsonl")]
DESCRIPTIONS = records("type_description.jsonl")
HASHES = json.loads((SPEC / "catalog_hashes.json").read_text("utf-8"))


def case_id(case):
    return f"{case['id']}-{case['label']}"


def test_no_recorded_case_was_lost():
    assert (len(CASES), len(DESCRIPTIONS), len(HASHES)) == (866 + 9, 68, 222)


@pytest.mark.parametrize("case", CASES, ids=case_id)
def test_verdict_content_and_hash(case):
    found = json.loads(json.dumps(rosidl_view.view(case)))
    assert found["build_verdict"] == case["build_verdict"]
    if found["build_verdict"] == "accept":
        assert found["hash"] == case["hash"]
        assert found["parsed"] == rosidl_view.without_repeated_constants(case["parsed"])


@pytest.mark.parametrize("case", CASES, ids=case_id)
def test_whoever_suffers_is_warned(case):
    """What breaks later in the pipeline is accepted with a warning that says for whom."""
    _, report = rosidl_view.compile_case(case)
    if report.had_errors or case["build_verdict"] == "reject":
        return
    warned = {found.code for found in report if found.severity is Severity.WARNING}
    python = case["verdict"] == "reject"
    native = case.get("c_compiles") is False or case.get("cpp_compiles") is False
    # not seen in one file: a package that the standard library hides, a sibling's like name
    if python and case["pkg"] != "abc" and case["label"] != "snake collision":
        assert warned & {"IDL220", "IDL310"}
    if native:
        assert warned & {"IDL220", "IDL221", "IDL222", "IDL310", "IDL313"}


@pytest.mark.parametrize("case", DESCRIPTIONS, ids=case_id)
def test_a_type_is_described_as_rosidl_describes_it(case):
    model, report = rosidl_view.compile_case(case)
    assert model is not None
    assert not report.had_errors
    describer, name = model.describer, case["type_name"]
    assert describer.hash(name) == case["rihs01"]
    assert describer.description(name) == {
        "type_description": case["type_description"],
        "referenced_type_descriptions": case["referenced_type_descriptions"],
    }
    assert {other: describer.hash(other) for other in case["all_hashes"]} == case["all_hashes"]
    installed = describer.installed(name)["type_hashes"]
    assert installed[0]["type_name"] == name


@pytest.mark.parametrize("name", HASHES)
def test_every_message_of_the_catalogue_has_the_hash_that_rosidl_gives_it(name):
    report = Report()
    target = ir.TypeName.parse(name)
    source = catalog.source(target)
    assert source is not None
    interface = lower(parse(source), target, report)
    model = link(target.package, [interface], catalog, report)
    assert list(report) == []
    assert model.describer.hash(name) == HASHES[name]
