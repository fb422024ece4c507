"""Folders and files of this repository that tests look at."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
EXAMPLE = ROOT / "examples" / "my_robot_controller"
GOLDEN = ROOT / "golden"
SPEC = GOLDEN / "spec"
#: What rosidl says of each recorded file.
VERDICTS = SPEC / "accept_reject.jsonl"
#: What tests start as processes of their own, beside the real rclpy.
PROGRAMS = ROOT / "tests" / "ros" / "programs"
#: A package with every kind of field.
EVERY_KIND = ROOT / "tests" / "ros" / "every_kind"
