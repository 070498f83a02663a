"""``python -m sagnac``: the same as the ``sagnac`` command."""

import sys

from sagnac.cli import main

if __name__ == "__main__":
    sys.exit(main())
