"""Paths and the URIs of editors, on systems that are not this one as well."""

from pathlib import Path, PurePosixPath, PureWindowsPath

import pytest

from idlc.editor.documents import path_text, to_path, to_uri


@pytest.mark.parametrize(
    ("uri", "path"),
    [
        ("file:///c%3A/Users/me/my%20robot", "C:/Users/me/my robot"),
        ("file:///C:/Users/me/my%20robot", "C:/Users/me/my robot"),
        ("file://localhost/c:/x/A.msg", "C:/x/A.msg"),
        ("file:///c:", "C:/"),
        ("file://server/share/a/B.msg", "//server/share/a/B.msg"),
        ("file://server.local/c$/B.msg", "//server.local/c$/B.msg"),
        ("file:////server/share/B.msg", "//server/share/B.msg"),
        ("file://wsl%24/Debian/home/B.msg", "//wsl$/Debian/home/B.msg"),
        ("file:///d%3A/gr%C3%BC%C3%9Fe/%23a%3Fb.msg", "D:/grüße/#a?b.msg"),
    ],
)
def test_windows_paths(uri, path):
    found = PureWindowsPath(path_text(uri, on_windows=True))
    assert found == PureWindowsPath(path)
    assert found.is_absolute()
    again = to_uri(found)
    assert PureWindowsPath(path_text(again, on_windows=True)) == found
    assert again == found.as_uri()


@pytest.mark.parametrize(
    "path", ["/a/B.msg", "/a b/ü#?%.msg", "/c:/x", "/", "/a/\udcff/B.msg", "/a\\b"]
)
def test_posix_paths(path):
    uri = to_uri(PurePosixPath(path))
    assert path_text(uri, on_windows=False) == path
    assert path_text(uri.replace("file://", "file://localhost"), on_windows=False) == path


@pytest.mark.parametrize(
    "uri",
    "idlc:/jazzy/std_msgs/msg/Header.msg untitled:A file: file://x http://x/y file:///a%00b "
    "file://[/x file://other/a".split(),
)
def test_what_is_no_path_here(uri):
    assert path_text(uri, on_windows=False) == ""


def test_a_path_is_absolute():
    assert to_path("file:///a/b/../c") == Path("/a/c")
