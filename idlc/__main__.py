"""`python -m idlc`."""

import sys

from idlc.cli.main import main

sys.exit(main())
