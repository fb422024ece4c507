"""Commands on robots with 10,000 endpoints, some of them hostile, above a fake transport.

Each of them takes seconds, unless a step is quadratic: then it takes minutes, and the suite's limit
of a test's time ends it.
"""

import json

import pytest
from click.shell_completion import ShellComplete

from idlc.cli.app import app
from idlc.cli.main import main
from idlc.robot.keys import Entity, EntityKind, parse_token
from idlc.robot.live import connect
from idlc.robot.qos import QoSProfile
from idlc.robot.session import Session
from tests.robot.fake import write_files

MANY = 10_000
ADDRESS = "tcp/robot:7447"
STRING = "std_msgs/msg/String"
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
#: Publishers and subscriptions in turn.
KINDS = (EntityKind.PUBLISHER, EntityKind.SUBSCRIPTION)
DESCRIBE = "type_description_interfaces/srv/GetTypeDescription"


class Tokens:
    """A transport that shows tokens, and whose services never reply."""

    id = "me"

    def __init__(self, tokens):
        self._tokens = tokens

    def gid(self, entity):
        return entity.gid

    def entities(self, _domain, _timeout):
        return map(parse_token, self._tokens)

    def watch(self, _domain, callback):
        for token in self._tokens:
            callback(parse_token(token), True)
        return self

    def call(self, _entity, _payload, _attachment, callback, *, timeout):
        assert timeout > 0
        callback(None)

    def notes(self):
        return []

    def close(self):
        pass


def hash_of(number):
    return f"RIHS01_{number:064x}"


def topics(number):
    return {"name": f"/topic_{number}/image", "kind": EntityKind.PUBLISHER}


def similar(number):
    return {"name": f"/topic_{number}/image", "kind": KINDS[number % 2]}


def types(number):
    hash_ = hash_of(number)
    return {"name": f"/topic_{number}", "type": f"many_msgs/msg/T{number}", "hash": hash_}


def versions(number):
    kind = KINDS[number % 2]
    return {"name": "/one", "type": "many_msgs/msg/T", "hash": hash_of(number), "kind": kind}


def profiles(number):
    return {"name": "/one", "qos": QoSProfile(depth=number + 1), "kind": KINDS[number % 2]}


def actions(number):
    part, type_ = (("feedback", "FeedbackMessage"), ("get_result", "GetResult"))[number % 2]
    kind = (EntityKind.PUBLISHER, EntityKind.SERVICE)[number % 2]
    name, type_ = f"/move/_action/{part}", f"many_msgs/action/T_{type_}"
    return {"name": name, "type": type_, "hash": hash_of(number), "kind": kind}


def describers(number):
    if number % 2:
        return types(number)
    return {
        "name": f"/n{number}/get_type_description",
        "type": DESCRIBE,
        "kind": EntityKind.SERVICE,
    }


@pytest.fixture(params=[topics, similar, types, versions, profiles, actions, describers])
def robot(request, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    common = {"kind": EntityKind.PUBLISHER, "type": STRING, "hash": STRING_HASH}
    ids = {"domain": 0, "session": "f1", "node_id": 0}
    tokens = [
        Entity(**ids, id=n, node=f"n{n % 50}", **{**common, **request.param(n)}).token
        for n in range(MANY)
    ]
    monkeypatch.setattr(connect, "open_session", lambda *_, **__: Session(Tokens(tokens), 0))
    return request.param


@pytest.mark.long
def test_all_commands_end(robot, capsys):
    assert main(["show", ADDRESS]) == 0
    text = capsys.readouterr().out
    assert main(["show", ADDRESS, "--format", "json"]) == 0
    facts = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    names = {fact["name"] for fact in facts if fact["type"] in ("topic", "service", "action")}
    assert all(name in text for name in names if "get_type" not in name)
    assert len(names) == {topics: MANY, similar: MANY, types: MANY, describers: MANY}.get(robot, 1)
    assert main(["gen", ADDRESS, "-o", "out"]) in (0, 2)
    assert main(["check", ADDRESS]) == 0
    write_files("mine")
    # Robots whose nodes disagree break what is here; the others have nothing in common with it.
    status = 1 if robot in (versions, actions, describers) else 2
    assert main(["breaking", "mine", "--against", ADDRESS]) == status


def test_names_are_completed(robot):
    shell = ShellComplete(app, {}, "idlc", "_IDLC_COMPLETE")
    names = [item.value for item in shell.get_completions(["echo", ADDRESS], "/")]
    number = {topics: MANY, similar: MANY, types: MANY, describers: MANY // 2}.get(robot, 1)
    assert len(names) == len(set(names)) == number
