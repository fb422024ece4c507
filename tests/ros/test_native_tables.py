"""What idlc's libraries say of the wheels' messages is what rosidl's own libraries say."""

import json
import subprocess
import sys

import pytest

from tests.support.installed import SHARE, interfaces, names_in
from tests.support.native import install, model_of
from tests.support.paths import PROGRAMS


def packages():
    """Return the packages of the wheels that have rosidl's libraries."""
    libraries = SHARE.parent / "lib"
    end = "__rosidl_typesupport_introspection_cpp.so"
    return [one for one in interfaces() if (libraries / f"lib{one}{end}").exists()]


def read(whose, names, environment):
    done = subprocess.run(
        [sys.executable, PROGRAMS / "native_reader.py", whose, *names],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def told(tmp_path_factory, ros_environment):
    """Return what rosidl's libraries and idlc's say, by message."""
    prefix = tmp_path_factory.mktemp("prefix")
    for package in packages():
        install(model_of(SHARE / package), prefix)
    names = names_in(packages(), interfaces())
    assert len(names) > 200
    return [read(whose, names, ros_environment) for whose in ("rosidl", prefix)]


def differences(told, *keys):
    for name, one in told[0].items():
        other = told[1][name]
        for key in keys:
            one, other = one[key], other[key]
        if one != other:
            yield name, one, other


@pytest.mark.parametrize("flavour", ["c", "cpp"])
def test_every_field_is_where_and_what_rosidl_says(told, flavour):
    assert list(differences(told, flavour)) == []


def test_every_source_is_the_one_that_rosidl_has(told):
    for one in told[1].values():
        for source in one["about"]["sources"]:
            source[2] = "\n".join(source[2].splitlines())  # rosidl loses the last line's end
    assert list(differences(told, "about", "sources")) == []


@pytest.mark.parametrize("what", ["hash", "description", "referenced"])
def test_every_type_is_described_as_rosidl_does(told, what):
    assert list(differences(told, "about", what)) == []


def test_every_handle_says_whose_it_is(told):
    assert list(differences(told, "identifiers")) == []
    assert list(differences(told, "called")) == []
