"""Which distribution an environment has decides how the libraries for C++ tools look."""

import pytest

from idlc.generate.native.platforms import LAYOUTS
from idlc.generate.prefix import target_of
from idlc.project.prefixes import DEFAULT, distribution

RELEASES = {
    "humble": "3.1.9",
    "iron": "4.0.1",
    "jazzy": "4.6.6",
    "kilted": "4.9.8",
    "lyrical": "5.2.1",
    "rolling": "5.3.1",
}


@pytest.fixture(autouse=True)
def _no_distribution(monkeypatch):
    monkeypatch.delenv("ROS_DISTRO", raising=False)


@pytest.fixture
def prefix(tmp_path):
    """Return a function that makes a prefix with a version of rosidl."""

    def make(version):
        folder = tmp_path / f"prefix-{version}"
        share = folder / "share" / "rosidl_runtime_c"
        share.mkdir(parents=True)
        text = f"<package><name>rosidl_runtime_c</name><version>{version}</version></package>"
        (share / "package.xml").write_text(text)
        return folder

    return make


@pytest.mark.parametrize("name", LAYOUTS)
def test_what_is_installed_tells(name, prefix):
    assert distribution([prefix(RELEASES[name])]).name == name


def test_an_overlay_tells_nothing_and_what_is_below_it_counts(prefix, tmp_path):
    assert distribution([tmp_path, prefix("3.1.6")]).name == "humble"


def test_of_several_the_first_counts_or_the_one_that_the_environment_names(prefix, monkeypatch):
    prefixes = [prefix("4.6.6"), prefix("4.9.8")]
    assert distribution(prefixes).name == "jazzy"
    monkeypatch.setenv("ROS_DISTRO", "kilted")
    assert distribution(prefixes).name == "kilted"
    monkeypatch.setenv("ROS_DISTRO", "humble")
    assert distribution(prefixes).name == "jazzy"


def test_without_an_installation_the_environment_is_believed(tmp_path, monkeypatch):
    assert distribution([tmp_path]).name == DEFAULT
    monkeypatch.setenv("ROS_DISTRO", "lyrical")
    assert distribution([tmp_path]).name == "lyrical"


@pytest.mark.parametrize("version", ["9.0.0", "4.7.1", "five", "5"])
def test_a_release_that_is_not_known_gets_no_library(version, prefix):
    found = distribution([prefix(version)])
    assert found.name == ""
    assert f"rosidl {version}" in str(target_of(found))


def test_a_name_that_is_not_known_gets_no_library(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_DISTRO", "foxy")
    assert "ROS_DISTRO=foxy" in str(target_of(distribution([tmp_path])))


@pytest.mark.parametrize("content", [b"", b"<package>", b"\xff\xfe\0", b"<package><version/>" * 9])
def test_a_broken_file_tells_nothing(content, tmp_path):
    (tmp_path / "share" / "rosidl_runtime_c").mkdir(parents=True)
    (tmp_path / "share" / "rosidl_runtime_c" / "package.xml").write_bytes(content)
    assert distribution([tmp_path]).name == DEFAULT
