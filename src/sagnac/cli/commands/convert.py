"""``sagnac convert``: one format into another."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from sagnac import overwriting
from sagnac.cli import progress as progresses
from sagnac.cli.errors import DONE
from sagnac.cli.options import NO_STATEMENT, Force, Reading, statement_of
from sagnac.cli.output import print_paths
from sagnac.cli.reading import read_file
from sagnac.cli.settings_file import inputs


def convert(
    source: Annotated[Path, Parameter(name="IN", help="A recording.")],
    target: Annotated[Path, Parameter(name="OUT", help="Its suffix says the format.")],
    /,
    *,
    options: Reading = NO_STATEMENT,
    force: Force = False,
) -> int:
    """Read a recording and write it so that reading it again needs no option."""
    from sagnac.formats.metadata import of_conversion

    statement = statement_of(options)
    reads = inputs([source], options)
    overwriting.require_free(of_conversion(target), reads, force=force)
    with progresses.shown() as progress:
        recording = read_file(source, statement, progress, memory=options.memory).recording
        from sagnac.formats import write

        progress("write", 0.0)
        written = write(recording, target, force=force)
    from sagnac.report import text

    print(text.blocks(text.recording(recording), text.notes(recording.notes)))
    print_paths([written])
    return DONE
