"""idlc's classes in the place of rosidl's: the same operations, compared by what comes of them."""

import json
import re
import shutil
import subprocess
import sys
from collections import Counter

import pytest

from tests.ros.drop_in.differences import DIFFERENCES, Case, refuses
from tests.support.installed import SHARE, generate, interfaces, names_in
from tests.support.paths import DOCS, EVERY_KIND, PROGRAMS

#: Messages with fields of all kinds.
CHECKED = [
    *("test_msgs/msg/BasicTypes", "test_msgs/msg/Strings", "test_msgs/msg/Arrays"),
    *("test_msgs/msg/BoundedSequences", "test_msgs/msg/UnboundedSequences", "test_msgs/msg/Nested"),
]
#: How a key names a field and the value that is given to it.
KEY = re.compile(
    r"(?P<message>[\w/]+)(?:\.(?P<field>\w+) = (?P<value>.*?)(?P<checked>, checked)?"
    r"|\((?P<field_2>\w+)=(?P<value_2>.*)\)|\.(?P<field_3>\w+) (?:aliases )?(?P<value_3>.*)| .*)"
)


def start(outcomes, names, environment):
    command = [sys.executable, str(PROGRAMS / "drop_in_side.py"), str(outcomes), *names]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def load(path):
    with path.open(encoding="utf-8") as lines:
        return dict(map(json.loads, lines))


@pytest.fixture(scope="module")
def classes(tmp_path_factory):
    """Return a folder with idlc's classes for every package of the wheels."""
    out = tmp_path_factory.mktemp("classes")
    for package in interfaces():
        generate(SHARE / package, out / package)
    return out


def outcomes(classes, environment, folder, names):
    """Return every operation with both outcomes, bytes as idlc writes what they say.

    rosidl's classes are installed, or where the environment's PYTHONPATH says.
    """
    official, idlc = folder / "official.jsonl", folder / "idlc.jsonl"
    theirs = environment | {"PYTHONPATH": str(classes)}
    both = [start(official, names, environment), start(idlc, names, theirs)]
    for process in both:
        _, errors = process.communicate()
        assert process.returncode == 0, errors[-3000:]
    command = [sys.executable, str(PROGRAMS / "drop_in_canonical.py"), str(official), str(idlc)]
    done = subprocess.run(command, env=theirs, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    shapes = json.loads(done.stdout)
    ours, known = load(idlc), load(official)
    assert list(ours) == list(known)
    return [case_of(key, known, ours, shapes) for key in known]


def case_of(key, official, idlc, shapes):
    match = KEY.fullmatch(key)
    assert match, key
    parts = match.groupdict()
    field = parts["field"] or parts["field_2"] or parts["field_3"] or ""
    value = parts["value"] or parts["value_2"] or parts["value_3"] or ""
    checked = official.get(f"{parts['message']}.{field} = {value}, checked", {})
    right = official.get(f"{parts['message']}.{field} = list", {})
    shape = shapes[parts["message"]].get(field, [])
    return Case(key, shape, value, checked, right, official[key], idlc[key])


def agree(case):
    """Return whether both sides did the same."""
    if same(case.official.get("told"), case.idlc.get("told")) and "told" in case.official:
        return True
    if not refuses(case.official) or not refuses(case.idlc):
        return case.official == case.idlc
    raised, ours = case.official.get("raised"), case.idlc.get("raised")
    if raised is None or ours is None:
        return raised is None
    # what is refused when it is assigned can be caught there as the same exception; rosidl's
    # check of bounded strings stumbles over what has no length
    return raised[0] in ours or (case.is_checked and ours[0] == "AssertionError")


def same(official, idlc):
    """Return whether two answers are the same; refusals are, if both can be caught alike."""
    if isinstance(official, dict) and isinstance(idlc, dict):
        return official.keys() == idlc.keys() and all(
            same(official[key], idlc[key]) for key in official
        )
    if isinstance(official, list) and official and official[-1] == "Exception":
        return official[0] in idlc
    return official == idlc


def reason_of(case):
    """Return the name of what explains a difference, nothing for one that nobody knows."""
    if agree(case):
        return "the same"
    return next((one.__name__ for one in DIFFERENCES if one(case)), None)


def compared(cases, record_property):
    """Return how often each difference is seen; fail at one that is not known."""
    seen, unknown = Counter(), {}
    for case in cases:
        reason = reason_of(case)
        seen[reason] += 1
        if reason is None:
            kind = (str(case.field), case.value or case.key.partition(" ")[2], "(" in case.key)
            text = f"{case.key}\n    {case.official}\n    {case.idlc}"
            unknown.setdefault(kind, []).append(text)
    told = ", ".join(f"{count:,} {reason}" for reason, count in seen.most_common())
    record_property("found", f"{len(cases):,} operations with both classes: {told}")
    examples = [f"{len(texts)} x {texts[0]}" for texts in unknown.values()]
    assert not unknown, f"{len(unknown)} kinds of differences:\n" + "\n".join(examples[:60])
    return seen


@pytest.mark.long
def test_every_difference_is_known_and_every_known_one_is_seen(
    classes, ros_environment, record_property, tmp_path
):
    found = interfaces()
    names = names_in(sorted(found), found)
    assert len(names) > 200
    cases = outcomes(classes, ros_environment, tmp_path, names)
    seen = compared(cases, record_property)
    assert {one.__name__ for one in DIFFERENCES} <= set(seen)


@pytest.mark.long
def test_the_environment_lets_all_messages_check(
    classes, ros_environment, record_property, tmp_path
):
    environment = ros_environment | {"ROS_PYTHON_CHECK_FIELDS": "1"}
    cases = outcomes(classes, environment, tmp_path, CHECKED)
    assert "unknown_keywords" not in compared(cases, record_property)
    taken = [case.key for case in cases if reason_of(case) == "wrong_values"]
    assert [key for key in taken if "append" not in key] == []  # lists cannot check


@pytest.mark.long
def test_invented_messages_of_every_kind(classes, ros_environment, record_property, tmp_path):
    """rosidl's classes without its C code: all but what is sent."""
    source, theirs = tmp_path / "source", tmp_path / "rosidl" / "every_kind"
    shutil.copytree(EVERY_KIND / "msg", source / "msg")
    (source / "msg" / "Keywords.msg").unlink()  # rosidl's Python cannot be imported
    command = [sys.executable, str(PROGRAMS / "rosidl_package.py"), str(source), str(theirs)]
    subprocess.run(command, check=True, capture_output=True)
    generate(source, classes / "every_kind")
    names = [f"every_kind/msg/{path.stem}" for path in sorted(source.glob("msg/*.msg"))]
    environment = ros_environment | {"PYTHONPATH": str(theirs.parent), "IDLC_NO_WIRE": "1"}
    cases = outcomes(classes, environment, tmp_path, names)
    assert compared(cases, record_property)["the same"] > 10_000


def test_the_document_lists_the_differences():
    text = (DOCS / "differences.md").read_text(encoding="utf-8")
    headings = re.findall(r"^## (.+)$", text, re.MULTILINE)
    named = {one.__name__.replace("_", " ").capitalize() for one in DIFFERENCES}
    assert sorted(headings) == sorted(named)
