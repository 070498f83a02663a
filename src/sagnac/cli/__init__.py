"""The command line."""

import sys

try:
    from sagnac.cli.app import main
except KeyboardInterrupt:
    # Nothing has begun. Raised inside of exec, it would end Python as by SIGINT: see `main`.
    exec("")
    print("sagnac: interrupted", file=sys.stderr)
    sys.exit(130)

__all__ = ["main"]
