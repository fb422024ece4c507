"""The files that C++ tools load: sound for every tool, small, and the same from the same input."""

import hashlib
import json
import os
import re
import shutil
import sys
from pathlib import Path

import pytest

from idlc.generate.native.library import MACHINES as MADE_FOR
from idlc.generate.native.library import OWN, libraries
from idlc.generate.native.platforms import LAYOUTS
from idlc.model import derive
from tests.support.generated import model_of
from tests.support.paths import ROOT
from tests.support.tools import MACHINES, run, tool

FIELDS = """
bool flag
uint8[3] fixed
string<=10 name "quoted"
wstring wide
float64[] many
geometry_msgs/Pose[<=5] poses
Empty[2] nothing
"""
ORDINARY = {
    "msg/Every.msg": FIELDS,
    "msg/Empty.msg": "",
    "srv/Ask.srv": "int32 a\n---\nint32 b\n",
    "action/Do.action": "int32 a\n---\nint32 b\n---\nint32 c\n",
}
IDENTIFIER = re.compile(r"__(\w+)\.so$")
HERE = Path(__file__).parent
AGAIN = """
import hashlib, sys
from tests.generate.native import test_file as t
model = t.model_of("demo_msgs", t.ORDINARY)
for content in t.libraries(model, t.MADE_FOR[sys.argv[1]]).values():
    print(hashlib.sha256(content).hexdigest())
"""
LONG = "N" + "a" * 199
HOSTILE = {
    "empty structures": {f"msg/M{i}.msg": "" for i in range(9)},
    "many messages": {f"msg/M{i}.msg": "int32 a\n" for i in range(900)},
    "many fields": {"msg/M.msg": "".join(f"string f{i} 'x'\n" for i in range(5000))},
    "long names": {f"msg/{LONG}.msg": "", "msg/M.msg": f"{LONG} f{'o' * 199}\n"},
    "deep": {
        "msg/M0.msg": "int8 a\n",
        **{f"msg/M{i}.msg": f"int8 a\nM{i - 1}[3] deep\n" for i in range(1, 25)},
    },
    "a chain": {
        "msg/M0.msg": "int8 a\n",
        **{f"msg/M{i}.msg": f"M{i - 1} next\n" for i in range(1, 120)},
    },
    "large numbers": {
        "msg/M.msg": f"uint8[{2**32 - 1}] a\nuint8[{2**70}] b\nstring<={2**70}[<={2**70}] c\n",
        "msg/N.msg": f"M[{2**32 - 1}] a\nM[{2**32 - 1}] b\n",
    },
    "texts": {
        "msg/M.msg": '# \x01 \u202e \U0001f600\nwstring w \'\U0001f600\'\nstring s "\\0 % \\" "\n'
    },
}


@pytest.fixture(params=MACHINES)
def machine(request):
    return request.param


@pytest.fixture(scope="module")
def model():
    return model_of("demo_msgs", ORDINARY)


def write(folder, content):
    for name, data in content.items():
        (folder / name).write_bytes(data)
    return [folder / name for name in content]


def assert_sound(path):
    assert run(tool("eu-elflint"), "--gnu-ld", "--strict", path) == "No errors\n"
    run(tool("readelf"), "--all", "--wide", path)


def test_the_tools_of_binaries_find_nothing_wrong(model, machine, tmp_path):
    for path in write(tmp_path, libraries(model, MADE_FOR[machine])):
        assert_sound(path)
        for name, *words in (
            ("strip", "--strip-all"),
            ("strip", "--strip-unneeded"),
            ("strip", "--strip-unneeded", "--remove-section=.comment", "--remove-section=.note"),
            ("objcopy", "--strip-all"),
            ("patchelf", "--set-rpath", "$ORIGIN"),
        ):
            copy = tmp_path / f"copy-{path.name}"
            shutil.copy(path, copy)
            run(tool(name, None if name == "patchelf" else machine), *words, copy)
            run(tool("readelf"), "--all", "--wide", copy)
            if machine == "x86_64":
                assert_answers(copy, model)


def assert_answers(path, model):
    """Load a library in a process of its own, and look at each of its messages."""
    identifier = IDENTIFIER.search(path.name)[1]
    start = f"{identifier}__get_message_type_support_handle__"
    known = {
        start + "__".join(message.name): [field.name for field in message.wire_fields]
        for one in model.own
        for message in derive.messages(one)
    }
    words = ("-I", HERE / "native_load.py", path, identifier)
    run(sys.executable, *words, input=json.dumps(known))


def test_nothing_can_be_written_and_executed(model, machine, tmp_path):
    for path in write(tmp_path, libraries(model, MADE_FOR[machine])):
        said = run(tool("readelf"), "--segments", "--dynamic", "--notes", "--wide", path)
        loads = re.findall(r"^ +LOAD .* ([R ][W ][E ]) 0x\w+$", said, re.MULTILINE)
        assert loads == ["R  ", "R E", "RW "]
        assert re.search(r"GNU_STACK .* RW  0x10$", said, re.MULTILINE)
        assert re.search(r"FLAGS\) +BIND_NOW\n.*Flags: NOW NODELETE\n", said)
        assert not re.search("TEXTREL|INIT", said)
        assert ("IBT, SHSTK" if machine == "x86_64" else "BTI") in said
        page = MADE_FOR[machine].page
        begin, size = re.search(r"GNU_RELRO +\w+ (\w+) \w+ \w+ (\w+) ", said).groups()
        assert (int(begin, 16) + int(size, 16)) % page == 0


def test_the_same_input_gives_the_same_bytes(model, machine):
    again = model_of("demo_msgs", dict(reversed(ORDINARY.items())))
    made = libraries(again, MADE_FOR[machine])
    assert libraries(model, MADE_FOR[machine]) == made
    digests = [hashlib.sha256(content).hexdigest() for content in made.values()]
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONHASHSEED": seed}
        assert run(sys.executable, "-c", AGAIN, machine, env=environment).split() == digests


def test_the_build_id_is_of_the_content(model, machine, tmp_path):
    other = model_of("demo_msgs", {**ORDINARY, "msg/Empty.msg": "# a comment\n"})
    found = set()
    for content in (libraries(model, MADE_FOR[machine]), libraries(other, MADE_FOR[machine])):
        for path in write(tmp_path, content):
            said = run(tool("readelf"), "--notes", path)
            found.add(re.search(r"Build ID: ([0-9a-f]{40})\n", said)[1])
    assert len(found) == 4


def test_the_files_of_ten_messages_are_small(machine):
    for content in libraries(model_of("p", messages(10)), MADE_FOR[machine]).values():
        assert len(content) < 100_000


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_distribution_has_a_sound_file(model, layout, tmp_path):
    for path in write(tmp_path, libraries(model, MADE_FOR["x86_64"], LAYOUTS[layout])):
        assert_sound(path)


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_packages(name, machine, tmp_path):
    model = model_of("hostile", HOSTILE[name])
    for path in write(tmp_path, libraries(model, MADE_FOR[machine])):
        assert_sound(path)
        said = run(tool("nm", machine), "--dynamic", "--defined-only", path)
        assert len(said.splitlines()) == len(HOSTILE[name])
        if machine == "x86_64":
            assert_answers(path, model)


def test_each_added_message_costs_the_same():
    sizes = [
        sum(map(len, libraries(model_of("p", messages(n)), MADE_FOR["x86_64"]).values()))
        for n in (100, 200, 300)
    ]
    assert abs((sizes[2] - sizes[1]) - (sizes[1] - sizes[0])) < 10_000


def messages(count):
    fields = "std_msgs/Header header\nstring name\ngeometry_msgs/Pose pose\nfloat64[] values\n"
    return {f"msg/M{i}.msg": fields for i in range(count)}


def test_the_files_have_the_names_that_tools_look_for(model):
    names = (OWN, "rosidl_typesupport_introspection_cpp")
    expected = [f"libdemo_msgs__{name}.so" for name in names]
    assert list(libraries(model, MADE_FOR["x86_64"])) == expected


def test_a_package_without_messages_needs_no_library(machine):
    assert libraries(model_of("empty", {}), MADE_FOR[machine]) == {}
