"""QoS profiles that parameters of the node override, such as `qos_overrides./t.publisher.depth`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import IntEnum
from typing import Any, NamedTuple

from idlc.robot.nodes.interfaces import standard
from idlc.robot.parameters import ParameterAlreadyDeclaredException
from idlc.robot.qos import QoSPolicyKind, QoSProfile, qos_profile


class InvalidQosOverridesError(Exception):
    """A callback refused a profile, or an override is not a value of its policy."""


class QoSOverridingOptions(NamedTuple):
    """The policies that parameters override; `callback` checks the profile that they make.

    `entity_id` tells apart endpoints of one topic.
    """

    policy_kinds: Iterable[QoSPolicyKind]
    callback: Callable[[QoSProfile], Any] | None = None
    entity_id: str | None = None

    @classmethod
    def with_default_policies(
        cls, *, callback: Callable[[QoSProfile], Any] | None = None, entity_id: str | None = None
    ) -> QoSOverridingOptions:
        """Return options for history, depth and reliability."""
        kinds = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY)
        return cls(kinds, callback, entity_id)


def QosCallbackResult(**values: Any) -> Any:  # noqa: N802 - rclpy's name of a class
    """Return rcl_interfaces/msg/SetParametersResult."""
    return standard("rcl_interfaces/msg/SetParametersResult").kind(**values)


def overridden(
    node: Any, kind: str, topic: str, qos: QoSProfile | int, options: QoSOverridingOptions | None
) -> QoSProfile:
    """Declare read-only parameters for an endpoint, and return the profile that they make.

    `kind` is `publisher` or `subscription`. Raises InvalidQosOverridesError.
    """
    profile = qos_profile(qos)
    if options is None:
        return profile
    absolute = node.resolve_topic_name(topic)
    place = kind if options.entity_id is None else f"{kind}_{options.entity_id}"
    subject = f"for {kind} `{absolute}` with id `{options.entity_id}`"
    for policy in options.policy_kinds:
        field = policy.name.lower()
        if kind == "subscription" and policy is QoSPolicyKind.LIFESPAN:
            continue
        name, value = f"qos_overrides.{absolute}.{place}.{field}", getattr(profile, field)
        default = value.name.lower() if isinstance(value, IntEnum) else value
        descriptor = standard("rcl_interfaces/msg/ParameterDescriptor").kind(
            description=f"{field} {subject}", read_only=True
        )
        try:
            chosen = node.declare_parameter(name, default, descriptor).value
        except ParameterAlreadyDeclaredException:
            chosen = node.get_parameter(name).value
        try:
            if isinstance(value, IntEnum):
                chosen = type(value)[chosen.upper()]
            setattr(profile, field, chosen)
        except (KeyError, ValueError) as error:
            raise InvalidQosOverridesError(f"`{name}` cannot be {chosen!r}: {error}") from None
    if options.callback is not None:
        result = options.callback(profile)
        if not result.successful:
            problem = f"Provided QoS overrides {subject}, are not valid: {result.reason}"
            raise InvalidQosOverridesError(problem)
    return profile
