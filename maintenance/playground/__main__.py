"""`python -m maintenance.playground OUT`: write the playground."""

import sys
from pathlib import Path

from maintenance.playground.build import build

if __name__ == "__main__":
    build(Path(sys.argv[1]).resolve())
