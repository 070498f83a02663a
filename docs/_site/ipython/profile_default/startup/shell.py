"""A cell that begins with ``%%sh`` runs in the shell; its output is that of a terminal."""

import subprocess
import sys

from IPython.core.magic import register_cell_magic


@register_cell_magic
def sh(_line: str, cell: str) -> None:
    """Run a cell; its progress goes to standard error, and a failure ends the page."""
    done = subprocess.run(["sh", "-e", "-c", cell], capture_output=True, text=True, check=False)
    print(done.stdout, end="")
    print(done.stderr, end="", file=sys.stderr)
    if done.returncode:
        raise RuntimeError(f"exit status {done.returncode}\n{done.stderr}")
