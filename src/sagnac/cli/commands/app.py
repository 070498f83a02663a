"""``sagnac app``: a page to work in."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from sagnac.cli.options import OUTPUT, Debug
from sagnac.cli.output import DONE


def app(
    file: Annotated[Path | None, Parameter(name="FILE")] = None,
    /,
    *,
    port: Annotated[int, Parameter(group=OUTPUT, metavar="N")] = 0,
    no_browser: Annotated[bool, Parameter(group=OUTPUT, negative="")] = False,
    debug: Debug = False,
) -> int:
    """A page to work in, for this machine alone: open, understand and analyze a recording.

    Prints its address, which holds a token, on one line, and serves it until it is interrupted.
    Files are opened and written below the folder of FILE, else the current one.

    Parameters
    ----------
    file
        A recording, or a folder of recordings.
    port
        To listen on; any that is free.
    no_browser
        Print the address, open nothing.
    """
    from sagnac.app.server import serve

    def opened(address: str) -> None:
        print(address, flush=True)
        if not no_browser:
            import threading
            import webbrowser

            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

    serve(file, port=port, opened=opened)
    return DONE
