"""The meanings of words of the command line."""

import pytest

from idlc.diagnostics.report import Report, ReportedError
from idlc.project.root import Root
from idlc.project.words import read_distro, read_version, read_word


@pytest.fixture(name="root")
def folder(tmp_path):
    for name in ("demo/msg/A.msg", "bag/a.mcap", "mixed/a.mcap", "mixed/msg/A.msg", "Header"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    return Root.at(tmp_path)


@pytest.mark.parametrize(
    ("word", "meaning"),
    [
        ("a.mcap", "recording"),
        ("gone/a.db3.zstd", "recording"),
        ("bag", "recording"),
        ("tcp/robot:7447", "recording"),
        ("dds", "recording"),
        ("mixed", "path"),
        ("demo", "path"),
        ("Header", "path"),
        ("gone/A.msg", "path"),
        ("./gone", "path"),
        ("gone", "name"),
        ("std_msgs/Header", "name"),
        ("std_msgs::msg::Header", "name"),
        ("std_msgs.msg.header", "name"),
        ("git:main", "path"),
        ("distro:humble", "path"),
    ],
)
def test_a_word_has_one_meaning(word, meaning, root):
    assert read_word(word, root) == meaning


def test_what_may_be_a_misspelt_type_is_what_the_command_expects(root):
    assert read_word("std_msgs/header", root) == "path"
    assert read_word("std_msgs/header", root, "name") == "name"


@pytest.mark.parametrize(
    ("word", "version"),
    [
        ("git:main", ("revision", "main")),
        ("git:a.mcap", ("revision", "a.mcap")),
        ("distro:humble", ("distribution", "humble")),
        ("a.mcap", ("recording", "a.mcap")),
        ("demo", ("path", "demo")),
    ],
)
def test_a_version_is_read_before_files_are_looked_for(word, version, root):
    (root.base / word).touch()  # a file in a repository cannot replace the revision
    assert read_version(word, root) == version


def test_an_unknown_distribution_is_reported():
    report = Report()
    with pytest.raises(ReportedError):
        read_distro("jazy", report)
    ((problem,)) = report
    assert "`jazy`" in problem.message
    assert "jazzy" in str(problem.hint)
