"""The command line."""

import sys

try:
    from sagnac.cli.app import main
except KeyboardInterrupt:
    # Nothing has begun. As in `main`, Python is to forget that it came inside of exec.
    exec("")
    print("sagnac: interrupted", file=sys.stderr)
    sys.exit(130)

__all__ = ["main"]
