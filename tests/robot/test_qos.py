"""Profiles, and which of them fit."""

import datetime

import pytest

from idlc.robot.qos import (
    FOLLOWS,
    INFINITE,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
    incompatible_policies,
    qos_profile,
    qos_profile_sensor_data,
)

SECOND = 10**9
#: The profile of this name in rclpy.
BEST_AVAILABLE = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.BEST_AVAILABLE,
    durability=DurabilityPolicy.BEST_AVAILABLE,
    deadline=FOLLOWS,
    liveliness=LivelinessPolicy.BEST_AVAILABLE,
    liveliness_lease_duration=FOLLOWS,
)


class Duration:
    nanoseconds = 7


def test_choices_of_the_middleware_are_filled_in():
    profile = QoSProfile(
        history=HistoryPolicy.SYSTEM_DEFAULT,
        reliability=ReliabilityPolicy.SYSTEM_DEFAULT,
        durability=DurabilityPolicy.SYSTEM_DEFAULT,
        liveliness=LivelinessPolicy.SYSTEM_DEFAULT,
        deadline=0,
    )
    assert profile == QoSProfile()
    assert (profile.depth, profile.deadline) == (42, INFINITE)
    assert profile.history is HistoryPolicy.KEEP_LAST


def test_a_number_is_a_depth_and_a_duration_has_nanoseconds():
    assert qos_profile(7) == QoSProfile(depth=7)
    assert qos_profile(qos_profile_sensor_data) == qos_profile_sensor_data
    assert qos_profile(qos_profile_sensor_data) is not qos_profile_sensor_data
    assert QoSProfile(depth=1, deadline=Duration()).deadline == 7
    assert QoSProfile(depth=1, reliability=2).reliability is ReliabilityPolicy.BEST_EFFORT


@pytest.mark.parametrize(
    "values",
    [
        {"depth": -1},
        {"depth": 2**31},
        {"deadline": -1},
        {"lifespan": 2**63},
        {"reliability": 3},
        {"durability": 9},
    ],
)
def test_values_out_of_range_are_refused(values):
    with pytest.raises(ValueError, match=r"\d"):
        QoSProfile(**values)


def test_values_of_another_type_are_refused():
    for value in (datetime.timedelta(seconds=1), 0.5):
        with pytest.raises(TypeError):
            QoSProfile(deadline=value)


@pytest.mark.parametrize(
    ("policy", "weak", "strong"),
    [
        ("reliability", ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE),
        ("durability", DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL),
        ("deadline", INFINITE, SECOND),
        ("deadline", 2 * SECOND, SECOND),
        ("liveliness", LivelinessPolicy.AUTOMATIC, LivelinessPolicy.MANUAL_BY_TOPIC),
        ("liveliness_lease_duration", INFINITE, SECOND),
    ],
)
def test_a_publisher_offers_at_least_what_is_requested(policy, weak, strong):
    less, more = QoSProfile(**{policy: weak}), QoSProfile(**{policy: strong})
    assert incompatible_policies(less, more) == (policy,)
    for offered, requested in ((more, less), (less, less), (more, more)):
        assert incompatible_policies(offered, requested) == ()
    for profile in (less, more):
        assert incompatible_policies(profile, BEST_AVAILABLE) == ()


def test_a_profile_can_be_changed():
    profile = QoSProfile(depth=3)
    copy = qos_profile(profile)
    profile.reliability = ReliabilityPolicy.BEST_EFFORT
    profile.history = 2
    assert profile == QoSProfile(depth=3, reliability=2, history=HistoryPolicy.KEEP_ALL)
    assert (copy, len({profile, copy, QoSProfile(depth=3)})) == (QoSProfile(depth=3), 2)
    for name, value in (("depth", -1), ("reliability", 9)):
        with pytest.raises(ValueError, match=str(value)):
            setattr(profile, name, value)
    assert profile.depth == 3
