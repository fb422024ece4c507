"""A long search, led by what of idlc each input reaches: it is called with TARGET SECONDS.

Needs atheris. What it finds goes to tests/hardening/corpus/TARGET/, where test_fuzz.py tries it.
"""

import shutil
import sys
import tempfile
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["idlc"]):
    from tests.support import fuzzing


def search(target, seconds):
    root = Path(tempfile.mkdtemp(prefix="idlc-fuzz-"))
    (root / ".git").mkdir()
    place, grown = root / "place", root / "grown"
    grown.mkdir()
    for number, data in enumerate(fuzzing.seeds(target)):
        (grown / str(number)).write_bytes(data)

    def attempt(data):
        place.mkdir()
        try:
            fuzzing.TARGETS[target](data, place)
        except BaseException:
            print("saved as", fuzzing.keep(target, data))
            raise
        finally:
            shutil.rmtree(place)

    options = [sys.argv[0], f"-max_total_time={seconds}", "-max_len=4096", "-verbosity=1"]
    atheris.Setup([*options, f"-artifact_prefix={root}/", str(grown)], attempt)
    atheris.Fuzz()


if __name__ == "__main__":
    search(sys.argv[1], int(sys.argv[2]))
