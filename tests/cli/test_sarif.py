"""`idlc check --format sarif`: whatever is reported, the official schema accepts it."""

import copy
import os
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support.files import write
from tests.support.sarif_schema import path_of, run_of, validator

pytestmark = pytest.mark.usefixtures("here")


def sarif(capsys, *words):
    main(["check", "--format", "sarif", *words])
    return run_of(capsys.readouterr().out)


def test_no_results(capsys):
    write("demo/msg/Drive.msg", "int8 a\n")
    run = sarif(capsys, "demo")
    assert run["results"] == []
    assert run["tool"]["driver"]["rules"] == []


def test_results_without_a_position(capsys):
    write("demo/msg/DriveMsg.msg", "int8 a\n")
    (result,) = sarif(capsys, "demo", "--select", "redundant-suffix")["results"]
    assert result["ruleId"] == "IDL407"
    assert [path_of(place) for place in result["locations"]] == ["demo/msg/DriveMsg.msg"]
    assert "region" not in result["locations"][0]["physicalLocation"]


def test_what_is_not_there(capsys):
    (result,) = sarif(capsys, "nowhere")["results"]
    assert (result["ruleId"], path_of(result["locations"][0])) == ("IDL602", "nowhere")


def test_several_files_places_and_packages(capsys):
    write("one/msg/Twice.msg", "int8 a\nint8 b\nint8 a\n")
    write("one/srv/Call.srv", "wstring a\n---\nflot64 b\n")
    write("two/msg/Twice.msg", "int8[<=2] a\nint8 A\n")
    run = sarif(capsys, "--select", "all")
    found = [(path_of(one["locations"][0]), one["ruleId"]) for one in run["results"]]
    assert found == sorted(found, key=lambda one: one[0])
    assert len({path for path, _ in found}) == 3
    (twice,) = [one for one in run["results"] if one["ruleId"] == "IDL208"]
    (related,) = twice["relatedLocations"]
    assert related["physicalLocation"]["region"]["startLine"] == 1
    ids = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert [ids[one["ruleIndex"]] for one in run["results"]] == [code for _, code in found]
    prints = [one["partialFingerprints"]["idlc/v1"] for one in run["results"]]
    assert len(set(prints)) == len(prints)


def test_edits_are_fixes(capsys):
    write("demo/msg/A.msg", "char[3] a  # \N{ROBOT FACE}\nstd_msgs/Header header\n")
    write("demo/package.xml", '<package format="3">\n  <name>demo</name>\n</package>\n')
    write("demo/CMakeLists.txt", "rosidl_generate_interfaces(demo msg/A.msg)\n")
    run = sarif(capsys, "demo", "--select", "package,char-type")
    fixed = {one["ruleId"]: one["fixes"] for one in run["results"] if "fixes" in one}
    assert sorted(fixed) == ["IDL422", "IDL451", "IDL453", "IDL454", "IDL463"]
    ((change,),) = (fix["artifactChanges"] for fix in fixed["IDL422"])
    (edit,) = change["replacements"]
    assert edit["insertedContent"] == {"text": "uint8"}
    region = {"startLine": 1, "startColumn": 1, "endLine": 1, "endColumn": 5}
    assert edit["deletedRegion"] == region


@pytest.mark.parametrize(
    "folder",
    ["mit Leerzeichen", "\N{GREEK SMALL LETTER ALPHA}\N{ROBOT FACE}", "50%", "a#b?c", "c:", "~[']"],
)
def test_paths_of_any_kind(folder, capsys, here):
    path = f"{folder}/demo/msg/A.msg"
    write(path, "flot64 \N{ROBOT FACE}\n")
    for words, expected in (((folder,), path), ((str(here / folder),), str(here / path))):
        results = sarif(capsys, *words)["results"]
        assert results
        found = {path_of(one["locations"][0]) for one in results}
        assert found in ({path}, {expected})


def test_a_path_that_is_no_text(capsys):
    path = Path("demo/msg", os.fsdecode(b"\xff.msg"))
    path.parent.mkdir(parents=True)
    path.write_bytes(b"int8 a\xff\n")
    assert sarif(capsys, "demo")["results"]


def test_the_schema_refuses_what_it_should():
    good = {"version": "2.1.0", "runs": [{"tool": {"driver": {"name": "x"}}, "results": []}]}
    assert validator().is_valid(good)
    for result in (
        {},
        {"message": {"text": "a"}, "level": "fatal"},
        {"message": {"text": "a"}, "path": "a"},
        {"message": {"text": "a"}, "locations": [place("a b")]},
        {"message": {"text": "a"}, "locations": [place("a", startLine=0)]},
    ):
        bad = copy.deepcopy(good)
        bad["runs"][0]["results"].append(result)
        assert not validator().is_valid(bad), result


def place(uri, **region):
    return {"physicalLocation": {"artifactLocation": {"uri": uri}, "region": region}}
