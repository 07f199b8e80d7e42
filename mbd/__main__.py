"""``python -m mbd``: the command line."""

import sys

from mbd.cli import main

if __name__ == "__main__":
    sys.exit(main())
