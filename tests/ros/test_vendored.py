"""A library that comes with the types that it uses, with ROS 2 and with a part of it."""

import json

import pytest

from tests.generate.test_vendoring import INTERFACES, gen, write
from tests.support.installed import SHARE


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    folder = tmp_path_factory.mktemp("libraries")
    write(folder / "track", INTERFACES)
    gen(folder / "track", folder / "path/lib/ros", "--vendor-deps")
    write(folder / "bees", {"msg/Bee.msg": "std_msgs/Header[] headers\n"})
    gen(folder / "bees", folder / "path/other", "--vendor-deps", package="bee_msgs")
    return folder / "path"


@pytest.mark.parametrize("where", ["installed", "copied"])
def test_it_publishes_with_what_is_there(where, program, libraries):
    out, complaints = (process := program("vendored.py", where, path=libraries)).communicate()
    assert process.returncode == 0, complaints
    described = json.loads((SHARE / "std_msgs/msg/Header.json").read_text(encoding="utf-8"))
    (digest,) = (
        entry["hash_string"]
        for entry in described["type_hashes"]
        if entry["type_name"] == "std_msgs/msg/Header"
    )
    names = [line.split()[0] for line in out.splitlines()]
    assert names == ["track_msgs/msg/Track", "std_msgs/msg/Header", "bee_msgs/msg/Bee"]
    assert digest.removeprefix("RIHS01_") in out


def test_hashes_of_installed_classes_are_those_of_their_descriptions(program, libraries):
    out, complaints = (process := program("vendored_hashes.py", path=libraries)).communicate()
    assert process.returncode == 0, complaints
    assert int(out) > 100
