"""`idlc breaking --against graph`: descriptions from other programs, and what differs among them.

The graphs here are recorded; those of tests/ros/test_graph_live.py run.
"""

import copy
import json
import random
from itertools import pairwise

import pytest

from idlc.cli.main import main
from idlc.model.from_description import DescriptionError, model_of_description
from idlc.versions.packages import compare
from idlc.wire.layout import oversized
from tests.support import generated
from tests.support.evolution import Evolution, compile_texts
from tests.support.hostile import PAYLOADS, assert_harmless
from tests.support.recorded_graph import RecordedGraph, descriptions, end, hash_of, take_the_place

TYPE = "demo/msg/Drive"
OLD = generated.model_of("demo", {"msg/Drive.msg": "float64 speed\n"})
NEW = generated.model_of("demo", {"msg/Drive.msg": "float64 speed\nint8 gear\n"})


def models():
    """Return models with every construct of the language, and all of the catalogue."""
    fixtures = generated.RECORDED / "idlc_fixtures"
    yield generated.model_of("idlc_fixtures", generated.files_of(fixtures))
    for package, files in generated.catalog_files().items():
        yield generated.model_of(package, files)


def is_untold(default):
    """Return whether nodes may have damaged a default value, or lost its sign."""
    return "\\" in default or default == "inf"


def test_a_description_means_what_its_files_mean():
    """Of every structure: fields, types, default values and hash come back."""
    number = 0
    for model in models():
        for name in map(str, model.messages):
            description = model.describer.description(name)
            found = model_of_description(description, name, hash_of(model, name), "/node")
            assert found.describer.description(name)["type_description"] == {
                **description["type_description"],
                "fields": [
                    {
                        **field,
                        "default_value": ""
                        if is_untold(field["default_value"])
                        else field["default_value"],
                    }
                    for field in description["type_description"]["fields"]
                ],
            }
            number += 1
    assert number > 400


@pytest.mark.parametrize("seed", range(30))
def test_descriptions_say_of_the_wire_what_files_say(seed):
    """The same fields, the same levels, whether a change is found in texts or in descriptions."""
    history = Evolution(seed)
    versions = []
    for _ in range(2):
        versions.append(compile_texts(history.texts()))
        history.edit()
        history.edit()
    told = []
    for model in versions:
        name = "p/msg/A"
        found = model_of_description(
            model.describer.description(name), name, hash_of(model, name), "/node"
        )
        found.own = tuple(message for message in found.interfaces.values())
        told.append(found)
    reached = {message.name for model in told for message in model.own}

    def facts(old, new):
        return {
            (change.code.id, change.subject, change.levels - {"source", "behaviour"})
            for change in compare(old.only(reached), new.only(reached)).changes
            if change.levels & {"wire", "hash"}
        }

    both = set.intersection(*({one.name for one in model.own} for model in told))
    if both == reached:
        assert facts(*told) == facts(*versions)


def spoiled(description, seed):
    """Return a description with one thing made wrong, as a program might send it."""
    chance = random.Random(seed)
    found = copy.deepcopy(description)
    parts = [found["type_description"], *found["referenced_type_descriptions"]]
    part = chance.choice(parts)
    field = chance.choice(part["fields"])
    match chance.randrange(6):
        case 0:
            part["type_name"] = chance.choice(
                [*PAYLOADS.values(), "", "a/b", parts[-1]["type_name"]]
            )
        case 1:
            field["name"] = chance.choice([*PAYLOADS.values(), "", part["fields"][0]["name"] * 2])
        case 2:
            key = chance.choice(["type_id", "capacity", "string_capacity"])
            field["type"][key] = chance.choice([0, 1, 13, 17, 48, 97, 145, 255, 2**63])
        case 3:
            names = [one["type_name"] for one in parts]
            field["type"]["nested_type_name"] = chance.choice([*names, *PAYLOADS.values()])
            field["type"]["type_id"] = chance.choice([1, 49, 145])
        case 4:
            part["fields"] += chance.choice(parts)["fields"]
        case 5:
            found["referenced_type_descriptions"] = parts[: chance.randrange(len(parts))]
    return found


def test_a_spoiled_description_is_a_model_or_not_believed():
    """Whatever it is, the hash that was announced decides, and nothing runs away or fails."""
    model = generated.model_of("nav_msgs", generated.catalog_files()["nav_msgs"])
    name = "nav_msgs/msg/OccupancyGrid"
    description = model.describer.description(name)
    refused = 0
    for seed in range(600):
        try:
            found = model_of_description(
                spoiled(description, seed), name, hash_of(model, name), "/node"
            )
        except DescriptionError as error:
            assert_harmless(str(error))
            refused += 1
        else:
            assert found.describer.hash(name) == hash_of(model, name)
            assert not list(oversized(found))
    assert refused > 400


def test_circles_and_depth_do_no_harm():
    def part(name, *targets):
        kind = {"type_id": 1, "capacity": 0, "string_capacity": 0}
        fields = [
            {"name": f"f{n}", "type": {**kind, "nested_type_name": one}, "default_value": ""}
            for n, one in enumerate(targets)
        ]
        return {"type_name": name, "fields": fields}

    circle = {
        "type_description": part("a/msg/A", "a/msg/B"),
        "referenced_type_descriptions": [part("a/msg/B", "a/msg/A")],
    }
    with pytest.raises(DescriptionError, match="contains itself"):
        model_of_description(circle, "a/msg/A", "", "/node")
    names = [f"a/msg/A{n}" for n in range(5000)]
    chain = [part(one, after, after) for one, after in pairwise(names)]
    deep = {
        "type_description": chain[0],
        "referenced_type_descriptions": [*chain[1:], part(names[-1])],
    }
    with pytest.raises(DescriptionError, match="another type hash"):
        model_of_description(deep, names[0], "", "/node")


@pytest.fixture
def say(monkeypatch, tmp_path, capsys):
    """Return what idlc says of a recorded graph, as status and text."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("idlc.project.prefixes.ament_prefixes", lambda: ())

    def run(graph, *words):
        take_the_place(monkeypatch, graph)
        status = main(["breaking", "--against", "graph", *words])
        return status, capsys.readouterr().out

    return run


def ends(*, old=(), new=(), type_=TYPE):
    """Return ends of `/drive` in two versions, as (node, role)."""
    hashes = [(old, hash_of(OLD, type_)), (new, hash_of(NEW, type_))]
    return [end(node, role, "/drive", type_, hash_) for who, hash_ in hashes for node, role in who]


TOLD = {
    "/old": descriptions(OLD, TYPE),
    "/new": descriptions(NEW, TYPE),
}


@pytest.mark.parametrize(
    ("old", "new", "expected", "levels"),
    [
        # the last field is not missed by whoever does not know it, but by whoever expects it
        ("publisher", "subscription", "field `gear` was added (`/old` → `/new`)", "wire, hash"),
        ("subscription", "publisher", "field `gear` was removed (`/new` → `/old`)", "hash, source"),
        ("publisher", "publisher", "field `gear` was", ""),
        ("subscription", "subscription", "field `gear` was", ""),
    ],
)
def test_the_direction_is_from_who_sends_to_who_reads(old, new, expected, levels, say):
    status, said = say(RecordedGraph(ends(old=[("/old", old)], new=[("/new", new)]), TOLD))
    assert status == 1
    assert "`demo/msg/Drive` has 2 versions" in said
    assert expected in said
    assert f"= breaks: {levels}" in said


def test_both_directions_count(say):
    """What one of them misreads is said, though the other reads it right."""
    both = [("/{}", "publisher"), ("/{}", "subscription")]
    graph = RecordedGraph(
        ends(old=[("/old", role) for _, role in both], new=[("/new", role) for _, role in both]),
        TOLD,
    )
    status, said = say(graph)
    assert status == 1
    assert "`/old` → `/new`: misread, or not delivered" in said
    assert "`/new` → `/old`: read right, or not delivered" in said
    assert said.count("field `gear`") == 1
    assert "= breaks: wire, hash" in said


def test_one_version_is_no_finding(say):
    pairs = [("/a", "publisher"), ("/b", "subscription"), ("", "subscription")]
    graph = RecordedGraph(ends(old=pairs))
    status, said = say(graph)
    assert (status, graph.asked) == (0, [])
    assert said == "no breaking changes; compared 2 nodes, 1 topic, 0 services, 0 actions\n"


def test_types_without_hash_are_not_compared(say, tmp_path):
    silent = end("/a", "publisher", "/drive", TYPE, "")
    known = end("/b", "publisher", "/other", "demo/msg/Other", hash_of(OLD, TYPE))
    status, said = say(RecordedGraph([silent, known]))
    assert (status, said.count("1 endpoint without a type hash")) == (1, 1)
    assert f"idlc did not compare `{TYPE}`: nodes announce no type hash" in said
    assert said.splitlines()[-1].startswith("1 not compared; no breaking changes in the rest; ")
    status, said = say(RecordedGraph([silent]))
    assert (status, "error[IDL521]" in said) == (2, True)
    (tmp_path / "demo/msg").mkdir(parents=True)
    (tmp_path / "demo/msg/Absent.msg").write_text("int8 a\n")
    status, said = say(RecordedGraph([silent, known]), "demo")
    assert (status, "error[IDL521]" in said) == (2, True)


def test_files_here_are_a_version(say, tmp_path):
    (tmp_path / "demo/msg").mkdir(parents=True)
    (tmp_path / "demo/msg/Drive.msg").write_text("float64 speed  # [m/s]\nint8 gear\n")
    graph = RecordedGraph(ends(old=[("/old", "publisher")]), TOLD)
    status, said = say(graph, "demo")
    assert status == 1
    assert "field `gear` was added (`/old` → your files)\n --> demo/msg/Drive.msg:2:6" in said
    (tmp_path / "pyproject.toml").write_text('[tool.idlc.breaking]\nlevels = ["behaviour"]\n')
    status, said = say(graph, "demo")
    assert status == 0
    (tmp_path / "pyproject.toml").unlink()
    status, said = say(RecordedGraph(ends(new=[("/new", "publisher")])), "demo")
    assert status == 0


def test_what_a_type_holds_is_told_once(say):
    """Of two types that hold the message that differs, and of none that is the same."""
    files = {"msg/A.msg": "Part part\nSame same\n", "msg/B.msg": "Part[] parts\n"}
    old, new = (
        generated.model_of("demo", {**files, "msg/Part.msg": part, "msg/Same.msg": "int8 a\n"})
        for part in ("int8 a\n", "int16 a\n")
    )
    found = [
        end(node, role, f"/{type_[-1].lower()}", type_, hash_of(model, type_))
        for type_ in ("demo/msg/A", "demo/msg/B")
        for node, role, model in (("/old", "publisher", old), ("/new", "subscription", new))
    ]
    told = {
        "/old": descriptions(old, "demo/msg/A", "demo/msg/B"),
        "/new": descriptions(new, "demo/msg/A", "demo/msg/B"),
    }
    _, said = say(RecordedGraph(found, told))
    assert said.count("error[IDL530]") == 2
    assert said.count("error[IDL507]") == 1
    assert said.count("the differences are in `demo/msg/Part`") == 2
    assert "IDL515" not in said


def test_versions_that_nobody_describes_are_known_by_their_hash(say):
    told = {"/old": "has no ~/get_type_description", "/new": TOLD["/old"]}
    found = ends(old=[("/old", "publisher"), ("", "publisher")], new=[("/new", "subscription")])
    status, said = say(RecordedGraph(found, told))
    assert status == 1
    assert "idlc has only its hash: `/old` has no ~/get_type_description" in said
    assert "idlc has only its hash: `/new` does not answer" in said
    assert "a program without a node" in said
    assert "might be misread" in said


def test_a_description_with_another_hash_is_not_believed(say):
    lies = {(TYPE, hash_of(OLD, TYPE)): NEW.describer.description(TYPE)}
    found = ends(old=[("/old", "publisher")], new=[("/new", "subscription")])
    _, said = say(RecordedGraph(found, {**TOLD, "/old": lies}))
    assert "`/old` is not plausible: its description has another type hash" in said


def test_sources_count_if_they_mean_what_is_announced(say):
    """They have what descriptions lack: constants, units, comments."""
    found = ends(old=[("/old", "publisher")], new=[("/new", "subscription")])
    right = {TYPE: "uint8 FAST=1\nfloat64 speed  # [m/s]\n"}
    new = {TYPE: "uint8 FAST=2\nfloat64 speed  # [km/h]\nint8 gear\n"}
    _, said = say(RecordedGraph(found, TOLD, {"/old": right, "/new": new}))
    assert "the unit of `speed` changed from [m/s] to [km/h] (`/old` → `/new`)" in said
    assert "constant `FAST` changed from 1 to 2" in said
    assert " --> demo/msg/Drive (/new):3:6" in said
    for text in (
        "uint8 FAST=2\nfloat32 speed\n",
        "=\x1b[31m",
        "Drive drive\n",
        "A a\n",
        "a" * 2**20,
    ):
        _, said = say(RecordedGraph(found, TOLD, {"/old": {TYPE: text}, "/new": new}))
        assert "constant `" not in said
        assert "no constants and default values of `demo/msg/Drive`: nodes sent only parts" in said
        assert "field `gear` was added (`/old` → `/new`)" in said


def test_a_service_is_told_by_its_events(say):
    """Without them only who has the same service is told what it is."""
    type_ = "demo/srv/Go_Request"
    old, new = (
        generated.model_of("demo", {"srv/Go.srv": f"{field} to\n---\n"})
        for field in ("float64", "float32")
    )
    ends_ = [
        end("/server", "server", "/go", type_, hash_of(old, type_)),
        end("/client", "client", "/go", type_, hash_of(new, type_)),
    ]
    status, said = say(RecordedGraph(ends_))
    assert status == 1
    assert said.count("turn on service introspection") == 2
    events, told = [], {}
    for node, model in (("/server", old), ("/client", new)):
        event = "demo/srv/Go_Event"
        topic = "/go/_service_event"
        events.append(end(node, "publisher", topic, event, hash_of(model, event)))
        told[node] = descriptions(model, event)
    status, said = say(RecordedGraph([*ends_, *events], told))
    assert "field `to` changed from `float32` to `float64` (`/client` → `/server`)" in said
    assert "only its hash" not in said


def test_an_allowance_holds_for_the_graph_and_may_wait(say, tmp_path):
    entry = '[[tool.idlc.breaking.allow]]\nat="{}"\nreason="r"\nuntil=2099-01-01\n'
    settings = "".join(map(entry.format, ("demo/msg/Drive*", "demo/msg/Other")))
    (tmp_path / "pyproject.toml").write_text(settings)
    found = ends(old=[("/old", "publisher")], new=[("/new", "subscription")])
    status, said = say(RecordedGraph(found, TOLD))
    assert status == 0
    assert said.startswith("no breaking changes; 2 allowed; compared")


@pytest.mark.parametrize("style", ["json", "github", "sarif", "junit", "gitlab"])
def test_every_format_has_the_findings(style, say):
    found = ends(old=[("/old", "publisher")], new=[("/new", "subscription")])
    status, said = say(RecordedGraph(found, TOLD), "--format", style)
    assert status == 1
    assert "IDL530" in said
    assert "IDL505" in said
    if style == "json":
        lines = [json.loads(line) for line in said.splitlines()]
        assert [line["node"] for line in lines if line["type"] == "endpoint"] == ["/new", "/old"]
        assert lines[-1]["seen"] == {"node": 2, "topic": 1, "service": 0, "action": 0}
        assert lines[-1]["errors"] == 2


def test_names_from_the_network_do_no_harm(say):
    for payload in PAYLOADS.values():
        found = [
            end(payload, "publisher", payload, TYPE, hash_of(OLD, TYPE)),
            end("/new", "subscription", payload, TYPE, hash_of(NEW, TYPE)),
            end("/new", "subscription", payload, payload, ""),
        ]
        told = {payload: descriptions(OLD, TYPE), "/new": "says: no"}
        status, said = say(RecordedGraph(found, told))
        assert status == 1
        assert_harmless(said)
        status, said = say(RecordedGraph(found, told), "--format", "github")
        commands = said.splitlines()
        assert [line.split()[0] for line in commands] == [
            "::error",
            "::error",
            "::error",
            "::notice",
        ]
        assert_harmless("\n".join(line.removeprefix("::") for line in commands))


def test_the_timeout_is_the_graph_s(say, capsys):
    assert main(["breaking", ".", "--against", "old", "--timeout", "1"]) == 2
    assert "--timeout needs --against graph" in capsys.readouterr().err
