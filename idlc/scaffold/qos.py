"""Quality of service: the presets that publishers and subscribers can have."""

from __future__ import annotations

from typing import NamedTuple


class Qos(NamedTuple):
    """A preset: its name on the command line, and what stands for it in a module.

    `imports` come from rclpy.qos; `constant` is the line that defines `source`, if none does.
    """

    name: str
    source: str
    imports: tuple[str, ...] = ()
    constant: str = ""


DEFAULT = Qos("default", "10")
SENSOR_DATA = Qos("sensor_data", "qos_profile_sensor_data", ("qos_profile_sensor_data",))
LATCHED = Qos(
    "latched",
    "LATCHED",
    ("DurabilityPolicy", "QoSProfile"),
    "LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)",
)
PRESETS = (DEFAULT, SENSOR_DATA, LATCHED)
NAMES = tuple(preset.name for preset in PRESETS)


def preset(name: str) -> Qos:
    """Return the preset of a name; raise ValueError if there is none."""
    for one in PRESETS:
        if one.name == name:
            return one
    raise ValueError(f"--qos is one of {', '.join(NAMES)}, not {name!r}")
