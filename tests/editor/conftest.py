"""Editors that end with their tests."""

import pytest

from tests.support.editor import Editor


@pytest.fixture(scope="module")
def editor():
    """Return a function that starts an editor in some folders."""
    started = []

    def start(*folders, **options):
        started.append(Editor(*folders, **options))
        return started[-1]

    yield start
    for one in started:
        one.quit()


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Return a function that writes a package's files into a folder, and that folder."""

    def write(files, name="demo"):
        folder = tmp_path_factory.mktemp("workspace").resolve() / name
        manifest = f'<package format="3">\n  <name>{name}</name>\n</package>\n'
        for path, text in {".git/HEAD": "", "package.xml": manifest, **files}.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8", newline="")
        return folder

    return write
