"""Whether files and folders are surely what they were when they were read."""

import os
import time

import pytest

from idlc.project.find import DiskSnapshot

#: In nanoseconds; files that are written now are as if they were that old.
SECOND = 1_000_000_000


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "A.msg"
    path.write_text("int8 a\n")
    return path


def picture(file, begun):
    return DiskSnapshot({file.parent: file.parent.stat()}, [file, file.with_name("absent")], begun)


def replace(file):
    file.with_suffix(".new").write_text("int8 b\n")
    file.with_suffix(".new").replace(file)


CHANGES = {
    "longer": lambda file: file.write_text("int8 longer\n"),
    "removed": lambda file: file.unlink(),
    "replaced": replace,
    "a new one": lambda file: file.with_name("absent").write_text(""),
    "a folder instead": lambda file: (file.unlink(), file.mkdir()),
}


def test_nothing_changed(file):
    one = picture(file, time.time_ns() + SECOND)
    assert one.is_current()
    file.read_text()
    assert one.is_current()


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_what_changes_is_noticed(file, change):
    one = picture(file, time.time_ns() + SECOND)
    change(file)
    assert not one.is_current()


def test_what_may_have_changed_while_it_was_read_is_not_trusted(file):
    """Whichever text was read, the time is that of the last."""
    begun = time.time_ns()
    file.write_text("int8 b\n")
    assert not picture(file, begun).is_current()


def test_a_folder_that_changed_while_it_was_listed_is_not_trusted(file):
    """A second change within the tick, such as the end of a rename, has the same time."""
    status = file.parent.stat()
    begun = time.time_ns()
    assert not DiskSnapshot({file.parent: status}, [], begun).is_current()
    assert DiskSnapshot({file.parent: status}, [], begun + SECOND).is_current()


def test_times_in_the_future_are_like_others(file):
    future = time.time_ns() + 1000 * SECOND
    os.utime(file, ns=(future, future))
    assert picture(file, time.time_ns() + SECOND).is_current()
