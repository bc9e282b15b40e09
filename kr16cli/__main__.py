"""`python -m kr16cli` is `kr16`."""

from __future__ import annotations

import sys

from kr16cli.cli.entry import main

if __name__ == "__main__":
    sys.exit(main())
