"""RELEASING.md: the rehearsal passes on what is published, and notices what must not be."""

import json
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from maintenance.release import agreement, archives, extension, forms, prepare
from maintenance.release.project import FailedError, Project
from tests.support.files import write
from tests.support.paths import DOCS, ROOT
from tests.support.programs import clean_environment, ended, run
from tests.support.tools import tool

REPOSITORY = "https://github.com/someone/idlc"
HERE = Project(ROOT)


@pytest.fixture(autouse=True, scope="module")
def _git():
    tool("git")


def git(*words, cwd):
    who = ["-c", "user.name=me", "-c", "user.email=me@example.org", "-c", "commit.gpgsign=false"]
    return run("git", *who, *words, cwd=cwd)


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """A repository with the project's files, all in one commit."""
    folder = tmp_path_factory.mktemp("copied") / "idlc"
    for path in HERE.files():
        if not path.startswith(("golden/", "tests/", "benchmarks/")):
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / path, folder / path)
    git("init", "--quiet", cwd=folder)
    git("add", "--all", cwd=folder)
    git("commit", "--quiet", "--message", "all of it", cwd=folder)
    return Project(folder)


@pytest.fixture(scope="module")
def published(copied, tmp_path_factory):
    """The same after what RELEASING.md says to do before a release, committed."""
    project = Project(tmp_path_factory.mktemp("published") / "idlc")
    shutil.copytree(copied.root, project.root)
    prepare.publish_at(project, REPOSITORY)
    prepare.version_is(project, HERE.version, "2030-01-02")
    git("commit", "--quiet", "--all", "--message", "ready", cwd=project.root)
    return project


@pytest.fixture(scope="module")
def tools(tmp_path_factory):
    """A Python with the tools that look at releases, by hash as for the release itself."""
    folder = tmp_path_factory.mktemp("tools")
    run(sys.executable, "-m", "venv", folder / "env", cwd=folder)
    python = folder / "env/bin/python"
    for name in ("build", "release"):
        lock = ROOT / "maintenance/requirements" / f"{name}.txt"
        words = ("--quiet", "--disable-pip-version-check", "--require-hashes", "--no-deps")
        run(python, "-m", "pip", "install", *words, "--requirement", lock, cwd=folder)
    return python


@pytest.mark.long
def test_the_rehearsal_passes_on_what_is_published(published, tools, tmp_path):
    tag = f"v{HERE.version}"
    words = ("-m", "maintenance.release", "check", "--tag", tag, "--keep", tmp_path / "dist")
    status, said = ended(tools, *words, cwd=published.root, environment=clean_environment())
    assert status == 0, said
    assert "still to do" not in said
    assert said.count("ok  ") == 13
    (wheel,) = (tmp_path / "dist").glob("idlc-*.whl")
    with zipfile.ZipFile(wheel) as inside:
        metadata = inside.read(f"idlc-{HERE.version}.dist-info/METADATA").decode()
    assert f"Project-URL: Repository, {REPOSITORY}\n" in metadata
    links = re.findall(r"\]\(([^)#]+)\)", metadata)
    assert links
    assert all(link.startswith("https://") for link in links)
    assert git("status", "--porcelain", cwd=published.root) == "", "it changes nothing"


def test_documents_take_the_repository_from_one_place(published):
    for path in [*published.root.glob("*.md"), *published.root.rglob("docs/**/*.md")]:
        text = path.read_text(encoding="utf-8")
        assert "until idlc is published" not in text, path
        if path.name != "RELEASING.md":
            clone = r"\.\./idlc(?!/diagnostics/)|tools/idlc|wheels/|OWNER|someone/(?!idlc)"
            assert not re.search(clone, text), path
    assert f"\n  - repo: {REPOSITORY}\n    rev: v{HERE.version}\n" in published.text("docs/ci.md")
    assert f"uses: someone/idlc@v{HERE.version}\n" in published.text("docs/ci.md")
    for path in sorted((published.root / "templates/ci").iterdir()):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"\.\./idlc(?!/diagnostics/)|tools/idlc|wheels/", text), path
        assert HERE.version in text, path
    entries = [path for path in published.root.glob("editors/*/*") if path.is_file()]
    entries += [published.root / "editors/README.md", *published.root.glob("editors/neovim/*/*")]
    named = [path for path in entries if REPOSITORY in path.read_text("utf-8", "replace")]
    assert len(named) == 5
    assert not [path for path in entries if "OWNER" in path.read_text("utf-8", "replace")]
    assert f"\nrepository-code: {REPOSITORY}\n" in published.text("CITATION.cff")
    with pytest.raises(FailedError, match=r"names .* already"):
        prepare.publish_at(published, REPOSITORY)


def test_the_next_release_is_named_in_the_same_places(published, tmp_path):
    folder = tmp_path / "idlc"
    shutil.copytree(published.root, folder)
    project = Project(folder)
    write(folder / "CHANGELOG.md", "# Changelog\n\n## 0.10.1 (not released yet)\n")
    prepare.version_is(project, "0.10.1", "2031-01-02")
    assert project.version == "0.10.1"
    assert project.text("CHANGELOG.md").endswith("## 0.10.1 (2031-01-02)\n")
    assert project.text("CITATION.cff").count("date-released: 2031-01-02\n") == 1
    assert project.text("docs/ci.md").count("0.10.1") == 4
    assert HERE.version not in project.text("docs/ci.md").replace("0.10.1", "")
    assert "\n;; Version: 0.10.1\n" in project.text("editors/emacs/rosmsg-mode.el")
    assert "pkg:pypi/idlc@0.10.1\n" in project.text("editors/mason/package.yaml")
    lock = json.loads(project.text("editors/vscode/package-lock.json"))
    assert lock["version"] == lock["packages"][""]["version"] == "0.10.1"
    manifest = json.loads(project.text("editors/vscode/package.json"))
    assert manifest["version"] == "0.10.1"
    assert manifest["repository"]["url"] == f"{REPOSITORY}.git"


def test_after_a_release_the_next_version_is_in_development(published, tmp_path):
    project = Project(tmp_path / "idlc")
    shutil.copytree(published.root, project.root)
    changelog = project.text("CHANGELOG.md").replace("## ", "## 0.10.1 (to come)\n\n## ", 1)
    write(project.root / "CHANGELOG.md", changelog)
    prepare.version_is(project, "0.10.1", None)
    agreement.of_versions(project)
    assert "\n## 0.10.1 (not released yet)\n" in project.text("CHANGELOG.md")
    assert "date-released" not in project.text("CITATION.cff")
    assert "pkg:pypi/idlc@0.10.1\n" in project.text("editors/mason/package.yaml")
    with pytest.raises(FailedError, match="for the day"):
        agreement.for_the_public(project, "v0.10.1")
    for path in ("README.md", "docs/ci.md", "templates/ci/github.yml.jinja"):
        assert project.text(path) == published.text(path), "people can install what it names"


@pytest.mark.parametrize(
    ("path", "change", "version", "day", "says"),
    [
        ("CHANGELOG.md", None, "0.10.1", "2031-01-02", "add `## 0.10.1 (not released yet)`"),
        ("CITATION.cff", "version: ", HERE.version, "2031-01-02", "CITATION.cff names no version"),
        ("idlc/version.py", "__version__", HERE.version, "2031-01-02", "names no version"),
        ("CHANGELOG.md", None, "1.0", "2031-01-02", "not like 1.2.3"),
        ("CHANGELOG.md", None, HERE.version, "tomorrow", "not like 2026-12-31"),
    ],
)
def test_a_version_is_given_to_all_files_or_to_none(
    published, tmp_path, path, change, version, day, says
):
    project = Project(tmp_path / "idlc")
    shutil.copytree(published.root, project.root)
    if change:
        write(project.root / path, project.text(path).replace(change, "x"))
    files = [project.root / one for one in project.files()]
    before = [one.read_bytes() for one in files]
    with pytest.raises(FailedError, match=re.escape(says)):
        prepare.version_is(project, version, day)
    assert [one.read_bytes() for one in files] == before


def test_no_address_is_invented():
    """Files name the repository where it is published, and as long as it is not, none."""
    for path in HERE.files():
        if (
            path.endswith((".md", ".yml", ".yaml", ".toml", ".cff", ".json"))
            and "golden/" not in path
        ):
            found = re.findall(r"https://github\.com/[\w.-]+/idlc\b|OWNER/idlc", HERE.text(path))
            assert set(found) <= {HERE.repository}, path


@pytest.mark.parametrize(
    ("path", "old", "new", "judge", "message"),
    [
        ("CHANGELOG.md", "\n## ", "\n## 9.9.9 (2030-01-01)\n\n## ", "of_versions", "begin with"),
        ("CITATION.cff", "\nversion: ", "\nversion: 9", "of_versions", "CITATION.cff is not"),
        ("editors/vscode/package.json", '"version": "', '"version": "9', "of_versions", "not for"),
        (".github/workflows/ci.yml", '"3.13"', '"3.9"', "of_pythons", "tests Python 3.1"),
        ("pyproject.toml", " :: Python :: 3.13", " :: Python :: 3.9", "of_pythons", "classifiers"),
        ("action.yml", "@5fda", "@v5 # 5fda", "name_actions_by_hash", "action.yml uses actions/"),
        (".github/workflows/ci.yml", " # v7.0.1", "", "name_actions_by_hash", "ci.yml uses"),
    ],
)
def test_what_does_not_agree_is_noticed(copied, tmp_path, path, old, new, judge, message):
    shutil.copytree(copied.root, tmp_path / "idlc")
    project = Project(tmp_path / "idlc")
    function = getattr(agreement, judge, None) or getattr(forms, judge)
    function(project)
    text = project.text(path)
    assert old in text
    write(project.root / path, text.replace(old, new, 1))
    with pytest.raises(FailedError, match=message):
        function(project)


def test_a_tag_insists_on_everything(published, tmp_path):
    with pytest.raises(FailedError, match="the tag is v9"):
        agreement.for_the_public(published, "v9.9.9")
    tag = f"v{HERE.version}"
    agreement.for_the_public(published, tag)
    shutil.copytree(published.root, tmp_path / "idlc")
    project = Project(tmp_path / "idlc")
    write(project.root / "new.txt", "")
    with pytest.raises(FailedError, match="not all is committed"):
        agreement.for_the_public(project, tag)
    head = f"## {HERE.version} "
    write(project.root / "CHANGELOG.md", f"# Changelog\n\n{head}(not released yet)\n")
    with pytest.raises(FailedError, match="for the day"):
        agreement.for_the_public(project, tag)


def made_by_hand(folder, wheel_files, sdist_files):
    """Return archives with these files in them, all empty."""
    found = object.__new__(archives.Archives)
    found.project, found.wheel, found.sdist = HERE, folder / "a.whl", folder / "a.tar.gz"
    with zipfile.ZipFile(found.wheel, "w") as wheel:
        for name in wheel_files:
            wheel.writestr(name, "")
    with tarfile.open(found.sdist, "w:gz") as sdist:
        for name in sdist_files:
            sdist.addfile(tarfile.TarInfo(f"idlc-{HERE.version}/{name}"))
    return found


def test_a_missing_and_a_superfluous_file_are_noticed(tmp_path):
    asked = archives.Archives.__new__(archives.Archives)
    asked.project = HERE
    wheel, sdist = asked.in_wheel(), asked.in_sdist()
    made_by_hand(tmp_path, wheel, sdist).is_complete()
    lacking = made_by_hand(tmp_path, [one for one in wheel if one != "idlc/py.typed"], sdist)
    with pytest.raises(FailedError, match=r"a.whl lacks idlc/py.typed"):
        lacking.is_complete()
    fat = made_by_hand(tmp_path, wheel, [*sdist, "tests/x.py"])
    with pytest.raises(FailedError, match=r"a.tar.gz has what nobody needs: tests/x.py"):
        fat.is_complete()


VSIX = {
    "[Content_Types].xml": b"",
    "extension.vsixmanifest": b"",
    "extension/package.json": (ROOT / "editors/vscode/package.json").read_bytes(),
    "extension/icon.png": (ROOT / "editors/vscode/icon.png").read_bytes(),
    "extension/LICENSE.txt": (ROOT / "LICENSE").read_bytes(),
    "extension/readme.md": b"",
    "extension/language-configuration.json": b"{}",
    "extension/syntaxes/rosmsg.tmLanguage.json": b"{}",
    "extension/dist/extension.js": b"",
    "extension/dist/licenses.txt": b"vscode-languageclient 11.0.0",
}


@pytest.mark.parametrize(
    ("path", "content", "message"),
    [
        ("extension/readme.md", None, "too few or too many files: extension/readme.md"),
        ("extension/node_modules/x.js", b"", "too many files: extension/node_modules/x.js"),
        ("extension/package.json", b"{}", "another package.json"),
        ("extension/icon.png", b"<svg/>", "icon.png is not a PNG"),
        ("extension/LICENSE.txt", b"", "another LICENSE"),
        ("extension/dist/licenses.txt", b"", "lacks the licences"),
    ],
)
def test_an_extension_with_missing_or_superfluous_parts_is_noticed(
    tmp_path, path, content, message
):
    def packed(name, files):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            for inside, data in files.items():
                archive.writestr(inside, data)
        return tmp_path / name

    extension.is_complete(HERE, packed("whole.vsix", VSIX))
    changed = {name: data for name, data in {**VSIX, path: content}.items() if data is not None}
    with pytest.raises(FailedError, match=re.escape(message)):
        extension.is_complete(HERE, packed("changed.vsix", changed))


def test_archives_that_differ_are_noticed(tmp_path):
    (tmp_path / "again").mkdir()
    one = made_by_hand(tmp_path, ["a"], ["a"])
    archives.are_equal(one, one)
    with pytest.raises(FailedError, match="not the same when it is built again"):
        archives.are_equal(one, made_by_hand(tmp_path / "again", ["a"], ["b"]))


@pytest.mark.long
def test_installing_as_the_document_says(copied, tmp_path):
    """Both ways, pasted into a clone; what idlc imports is left out here, and so is the index."""
    text = (DOCS / "install.md").read_text(encoding="utf-8")
    first, second, third = re.findall(r"(?ms)^```sh\n(.*?)^```$", text)
    home = tmp_path / "home"
    home.mkdir()
    variables = {"HOME": str(home), "PIP_NO_DEPS": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    script = (
        f"{first}{second}pip uninstall -qy idlc\nexport PIP_NO_INDEX=1\n{third}idlc --version\n"
    )
    done = subprocess.run(
        ["sh", "-e", "-c", script],  # noqa: S607
        cwd=copied.root,
        env={**clean_environment(), **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count(f"idlc {HERE.version}\n") == 2
    assert (home / "idlc-env").is_dir()
    assert [path.name for path in (home / "idlc-wheels").iterdir()] == [
        f"idlc-{HERE.version}-py3-none-any.whl"
    ]


def test_every_community_file_is_there():
    for name in ("CITATION.cff", "CODE_OF_CONDUCT.md", "CONTRIBUTING.md", "LICENSE", "SECURITY.md"):
        assert Path(ROOT / name).is_file(), name
    form = HERE.text(".github/ISSUE_TEMPLATE/bug.yml")
    assert "label: idlc --version" in form
    assert "label: The interface" in form
