"""`python -m hovi` is the command `hovi`."""

import sys

from hovi.cli import main

if __name__ == "__main__":
    sys.exit(main())
