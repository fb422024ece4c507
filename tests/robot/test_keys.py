"""Tokens, keys, QoS and attachments: as the real rmw_zenoh_cpp sent them, and as nobody should."""

import json

import msgspec
import pytest

from idlc.robot.keys import (
    Entity,
    EntityKind,
    format_qos,
    pack_attachment,
    parse_attachment,
    parse_qos,
    parse_token,
)
from idlc.robot.qos import (
    INFINITE,
    MOST_DEPTH,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_action_status_default,
    qos_profile_parameters,
    qos_profile_rosout_default,
    qos_profile_sensor_data,
    qos_profile_services_default,
    qos_profile_system_default,
)
from tests.robot.test_qos import BEST_AVAILABLE
from tests.support.examples import given, st
from tests.support.paths import ROOT

CAPTURE = json.loads((ROOT / "golden/robot/rmw_zenoh.json").read_text(encoding="utf-8"))
TOKENS = [token for token, _ in CAPTURE["tokens"]]
SECOND = 10**9

part = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)
absolute = st.lists(part, min_size=1, max_size=4).map(lambda parts: "/" + "/".join(parts))
durations = st.integers(1, INFINITE)
profiles = st.builds(
    QoSProfile,
    history=st.sampled_from(HistoryPolicy),
    depth=st.integers(0, MOST_DEPTH),
    reliability=st.sampled_from(ReliabilityPolicy),
    durability=st.sampled_from(DurabilityPolicy),
    lifespan=durations,
    deadline=durations,
    liveliness=st.sampled_from(LivelinessPolicy),
    liveliness_lease_duration=durations,
)
nodes = {
    "domain": st.integers(0, 999_999),
    "session": st.from_regex(r"[0-9a-f]{1,32}", fullmatch=True),
    "node_id": st.integers(0, 10**9),
    "id": st.integers(0, 10**9),
    "enclave": absolute | st.just("/"),
    "namespace": absolute | st.just("/"),
    "node": part,
}
types = st.from_regex(
    r"[a-z][a-z0-9_]{0,8}/(msg|srv|action)/[A-Z][A-Za-z0-9_]{0,8}", fullmatch=True
)
entities = st.builds(Entity, kind=st.just(EntityKind.NODE), **nodes) | st.builds(
    Entity,
    kind=st.sampled_from([kind for kind in EntityKind if kind is not EntityKind.NODE]),
    name=absolute,
    type=types,
    hash=st.from_regex(r"RIHS01_[0-9a-f]{64}", fullmatch=True) | st.just(""),
    qos=profiles,
    **nodes,
)


@pytest.mark.parametrize(("token", "gid"), CAPTURE["tokens"])
def test_tokens_and_ids_are_those_of_rmw_zenoh(token, gid):
    entity = parse_token(token)
    assert entity.gid.hex() == gid
    assert Entity(**msgspec.structs.asdict(entity) | {"token": ""}).token == token


def test_a_token_is_read_part_by_part():
    token = next(token for token in TOKENS if "qos_sensor" in token)
    entity = parse_token(token)
    assert entity.kind is EntityKind.PUBLISHER
    assert (entity.domain, entity.session, entity.node_id) == (0, token.split("/")[2], 0)
    assert (entity.enclave, entity.namespace, entity.node) == ("/", "/ns/deep", "golden")
    assert (entity.node_name, entity.name) == ("/ns/deep/golden", "/ns/deep/qos_sensor")
    assert (entity.type, entity.hash) == ("my_robot/msg/Drive", token.split("/")[11])
    assert entity.qos == qos_profile_sensor_data


def test_messages_are_sent_on_the_key_of_their_publisher():
    by_gid = {parse_token(token).gid: parse_token(token) for token in TOKENS}
    for number, (key, attachment, *_) in enumerate(CAPTURE["samples"], 1):
        sequence, time, gid = parse_attachment(bytes.fromhex(attachment))
        assert by_gid[gid].key == key
        assert sequence == number
        assert pack_attachment(sequence, time, gid).hex() == attachment


def test_requests_and_replies_are_read():
    ((key, _, attachment, _),) = CAPTURE["requests"]
    assert parse_attachment(bytes.fromhex(attachment)).sequence == 1
    assert key.startswith("0/pure_add/my_robot::srv::dds_::Add_/RIHS01_07ca")
    ((key, attachment, _),) = CAPTURE["replies"]
    assert parse_attachment(bytes.fromhex(attachment)).gid == bytes(range(16))
    assert key in {parse_token(token).key for token in TOKENS if "/SS/" in token}


PROFILES = {
    "qos_default10": QoSProfile(depth=10),
    "qos_depth1": QoSProfile(depth=1),
    "qos_depth0": QoSProfile(depth=0),
    "qos_depth42": QoSProfile(depth=42),
    "qos_sensor": qos_profile_sensor_data,
    "qos_system": qos_profile_system_default,
    "qos_services": qos_profile_services_default,
    "qos_parameters": qos_profile_parameters,
}


def test_predefined_profiles_are_those_of_rmw_zenoh():
    texts = {token.split("/")[9].rpartition("%")[2]: token.split("/")[12] for token in TOKENS[1:]}
    assert {name: format_qos(profile) for name, profile in PROFILES.items()} == {
        name: texts[name] for name in PROFILES
    }
    assert format_qos(qos_profile_rosout_default) == texts["rosout"]
    assert format_qos(qos_profile_action_status_default) == ":1:,1:,:,:,,"
    best = "4:4:,10:,854775806:,:5,,854775806"
    assert format_qos(BEST_AVAILABLE) == best
    assert parse_qos(best) == BEST_AVAILABLE


@pytest.mark.parametrize(
    ("profile", "text"),
    [
        (QoSProfile(depth=10, history=HistoryPolicy.KEEP_ALL), "::2,10:,:,:,,"),
        (QoSProfile(depth=10, deadline=3 * SECOND // 2), "::,10:1,500000000:,:,,"),
        (QoSProfile(depth=10, lifespan=2 * SECOND), "::,10:,:2,0:,,"),
        (
            QoSProfile(
                depth=10,
                liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
                liveliness_lease_duration=3 * SECOND + 7,
            ),
            "::,10:,:,:3,3,7",
        ),
    ],
)
def test_other_profiles_are_written_as_rmw_zenoh_does(profile, text):
    assert format_qos(profile) == text
    assert parse_qos(text) == profile


@given(profiles)
def test_profiles_survive(profile):
    assert parse_qos(format_qos(profile)) == profile


@given(entities)
def test_tokens_survive(entity):
    assert parse_token(entity.token) == entity


int64 = st.integers(-(2**63), 2**63 - 1)


@given(st.tuples(int64, int64, st.binary(min_size=16, max_size=16)))
def test_attachments_survive(values):
    assert parse_attachment(pack_attachment(*values)) == values
    assert parse_attachment(pack_attachment(*values) + b"more") == values


def test_further_parts_are_ignored():
    for token in TOKENS[1:]:
        more = f"{token}/backends:cpu:;cuda:%25/x"
        assert msgspec.structs.replace(parse_token(more), token=token) == parse_token(token)
        assert parse_token(more).gid != parse_token(token).gid


def test_the_hashes_of_humble_are_unknown():
    token = TOKENS[-1].split("/")
    token[11] = "TypeHashNotSupported"
    entity = parse_token("/".join(token))
    assert entity.hash == ""
    assert entity.key.endswith("/TypeHashNotSupported")
    assert Entity(**msgspec.structs.asdict(entity) | {"token": ""}).token == "/".join(token)


@pytest.mark.parametrize("cut", range(1, 13))
def test_a_token_with_a_missing_part_is_refused(cut):
    parts = TOKENS[-1].split("/")
    assert parse_token("/".join(parts[:cut])) is None
    assert parse_token("/".join([*parts[:cut], "", *parts[cut + 1 :]])) is None


def bad_tokens():
    good = TOKENS[4].split("/")
    for at, texts in {
        0: ["@ros2", "ros2_lv"],
        1: ["-1", "x", "1" * 7, "٣"],
        2: ["G", "f" * 33, "F00"],
        4: ["1" * 11, "1.0"],
        5: ["XX", "nn", "MPS"],
        7: ["ns", "%ns%", "%%", "%n s", "%..", "%\0"],
        8: ["a-b", "1a", "a" * 256, "a%b", "ä"],
        9: ["x", "%", "%a%%b", "%" + "a" * 248, "%a\n", "%~"],
        10: [
            "x",
            "my_robot::msg::Drive",
            "a::b::dds_::C_",
            "..::msg::dds_::C_",
            "a::msg::dds_::C%_",
        ],
        11: ["..", "a b", "h" * 129],
        12: [
            "::,10:,:,:,",
            "::,x:,:,:,,",
            "9::,:,:,:,,",
            "::,99999999999:,:,:,,",
            "::,2147483648:,:,:,,",
            "::,1:9999999999,0:,:,,",
        ],
    }.items():
        for text in texts:
            yield "/".join([*good[:at], text, *good[at + 1 :]])
    yield "/".join([*good, "x" * 2048])


@pytest.mark.parametrize("token", [*bad_tokens()])
def test_a_malformed_token_is_refused(token):
    assert parse_token(token) is None
