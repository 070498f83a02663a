"""The command line."""

from sagnac.cli.app import main

__all__ = ["main"]
