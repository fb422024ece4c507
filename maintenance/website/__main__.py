"""`python -m maintenance.website OUT`: write the site."""

import sys
from pathlib import Path

from maintenance.website.build import build

if __name__ == "__main__":
    build(Path(sys.argv[1]))
    sys.stdout.write(f"open {sys.argv[1]}/index.html\n")
