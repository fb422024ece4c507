"""The C structures of other versions of ROS 2: found out, used, and refused where unknown."""

import ctypes
import json
import subprocess
import sys

import pytest

from tests.support.installed import SHARE, generate, installed_layout
from tests.support.paths import PROGRAMS
from tests.support.tools import lacks, run, tool

#: What a version's headers have that Humble's have not, and what it is called there.
VERSIONS = {
    "humble": (),
    "jazzy": ("KEYS",),
    "lyrical": ("KEYS", "BUFFERS"),
    "rolling": ("KEYS", "BUFFERS", "PLAIN_STRINGS"),
}
MEASURED = {
    "humble": [32, 112, 32, 24, 24],
    "jazzy": [40, 112, 33, 24, 24],
    "lyrical": [40, 120, 33, 32, 32],
    "rolling": [40, 120, 33, 32, 24],
}


def compiled(folder, version):
    """Return the library of ParameterValue's table, as a version of ROS 2 has it."""
    library = folder / f"{version}.so"
    words = [f"-D{one}" for one in VERSIONS[version]]
    soname = "-Wl,-soname,librcl_interfaces__rosidl_typesupport_introspection_c.so"
    command = (tool("gcc"), "-Wall", "-Werror", "-shared", "-fPIC", soname, *words)
    run(*command, PROGRAMS / "abi.c", "-o", library)
    return library


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Return a folder with a package of idlc's, whose type support measures."""
    folder = tmp_path_factory.mktemp("measured")
    generate(SHARE / "std_msgs", folder / "std_msgs")
    return folder


@pytest.fixture
def ask(package, ros_environment):
    def answer(*words):
        done = subprocess.run(
            [sys.executable, str(PROGRAMS / "abi_side.py"), *map(str, words)],
            env={**ros_environment, "PYTHONPATH": str(package)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr[-3000:]
        return json.loads(done.stdout)

    return answer


@pytest.mark.parametrize("version", VERSIONS)
def test_each_version_is_told_from_its_table(version, ask, tmp_path):
    assert ask("measure", compiled(tmp_path, version)) == MEASURED[version]


def test_the_installed_one_is_measured(ask):
    layout = installed_layout()
    expected = (layout.members, layout.member, layout.is_array)
    assert ask("installed") == [*expected, layout.primitive_sequence, layout.string_sequence]


@pytest.mark.parametrize("version", VERSIONS)
def test_a_table_with_one_other_word_is_refused_or_means_the_same(version, ask, tmp_path):
    words, refused = ask("alter", compiled(tmp_path, version))
    assert words > 150
    # only what nobody reads may differ: the functions beside the members, and padding
    assert refused > 0.8 * words


def test_the_fast_cdr_of_humble_is_known(ask):
    """Debian has it: version 1.0, as in ROS 2 Humble."""
    try:
        ctypes.CDLL("libfastcdr.so.1")
    except OSError:
        lacks("libfastcdr.so.1", "libfastcdr1")
    position, end = ask("fast_cdr", "libfastcdr.so.1")
    assert (8 * position, 8 * end) == (40, 72)
