"""`python -m maintenance.release`: prepare a release, or rehearse it.

RELEASING.md says when to do what.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from maintenance.release import agreement, archives, extension, forms, prepare
from maintenance.release.archives import Archives, RuntimeArchives
from maintenance.release.project import FailedError, Project

HERE = Project(Path(__file__).parents[2])


#: What has to be so of the project, and of its archives; the first failure ends it.
PROJECT = (
    agreement.of_versions,
    agreement.of_pythons,
    forms.name_actions_by_hash,
    forms.fit_their_schemas,
    forms.are_safe,
)
ARCHIVES = ("is_complete", "says_what_it_is", "works")


def check(tag: str | None, keep: Path | None) -> None:
    """Rehearse a release, and say what was found."""
    if tag is not None:
        agreement.for_the_public(HERE, tag)
    for step in PROJECT:
        step(HERE)
        _passed(step)
    with tempfile.TemporaryDirectory(prefix="release-") as place:
        for kind in (Archives, RuntimeArchives):
            made, again = (kind(HERE, Path(place) / kind.name / name) for name in ("1", "2"))
            archives.are_equal(made, again)
            print(f"{kind.name}:")
            _passed(archives.are_equal)
            for look in ARCHIVES:
                getattr(made, look)()
                _passed(getattr(made, look))
            if keep is not None:
                keep.mkdir(exist_ok=True)
                for path in made.both:
                    shutil.copy(path, keep)
    if HERE.repository is None:
        print("still to do before the first upload: say where the repository is (RELEASING.md)")


def _passed(step: Callable[..., None]) -> None:
    """Say what is known to be so from now on."""
    print(f"ok  {step.__doc__}", flush=True)


def main() -> int:
    """Run one of the commands and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m maintenance.release", description=__doc__)
    commands = parser.add_subparsers(required=True, dest="command")
    checking = commands.add_parser("check", help="rehearse a release")
    checking.add_argument("--tag", help="what is about to be uploaded: nothing may be left to do")
    checking.add_argument("--keep", type=Path, metavar="DIR", help="copy the archives there")
    opening = commands.add_parser("extension", help="check the archive of `make vscode`")
    opening.add_argument("vsix", type=Path)
    placing = commands.add_parser("repository", help="say where the project is published")
    placing.add_argument("url", metavar="https://github.com/OWNER/NAME")
    dating = commands.add_parser("version", help="give a version and its day to all files")
    dating.add_argument("version")
    dating.add_argument("--day", help="of the release; without it, the version is in development")
    given = parser.parse_args()
    try:
        if given.command == "check":
            check(given.tag, given.keep)
        elif given.command == "extension":
            extension.is_complete(HERE, given.vsix)
            _passed(extension.is_complete)
        elif given.command == "repository":
            prepare.publish_at(HERE, given.url)
        else:
            prepare.version_is(HERE, given.version, given.day)
    except FailedError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
