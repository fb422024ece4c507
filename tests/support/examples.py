"""Hypothesis with the settings of this project; only test modules that use it import it."""

from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

__all__ = ["HealthCheck", "example", "given", "settings", "st"]

# The same examples in every run, and no verdict that depends on how busy the machine is.
settings.register_profile(
    "idlc", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("idlc")
