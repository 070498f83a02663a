"""``sagnac reproduce``: the paper's experiment again."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from sagnac import overwriting
from sagnac.cli import output as results
from sagnac.cli.errors import DONE, UsageError, complain
from sagnac.cli.options import Debug, Folder, Force, Workers
from sagnac.cli.progress import standings


def reproduce(
    *,
    output: Folder = None,
    quick: Annotated[
        bool, Parameter(negative="", show_default=False, help="Tables of half an hour, not 2 h.")
    ] = False,
    workers: Workers = None,
    force: Force = False,
    debug: Debug = False,
) -> int:
    """The paper's Figures 1 to 6 and Tables 1 and 2 on the simulated rig, truth beside.

    Page, pictures and tables go into DIR, by default reproduction. Started again in the
    same folder it goes on where it stopped. Several processes work side by side, a recording each.
    """
    del debug
    folder = output or Path("reproduction")
    results.require_writable(folder)
    overwriting.require_free(overwriting.of_reproduction(folder), force=force)
    results.ready_to_draw()
    from sagnac.paper.plan import QUICK, Scope
    from sagnac.paper.reproduce import reproduce as make
    from sagnac.processes import means_of
    from sagnac.report import reproduction as pages
    from sagnac.report.reproduction_tables import summary

    try:
        means = means_of(workers)
    except ValueError as error:
        raise UsageError(f"--{error}") from error
    try:
        found = make(
            results.made(folder), QUICK if quick else Scope(), means=means, told=standings()
        )
    except KeyboardInterrupt:
        complain(f"stopped; start it again with the same folder, and it goes on ({folder})")
        raise
    written = pages.write(found, folder)
    print(summary(found), end="\n\n")
    print(f"{found.computed} of {len(found.outcomes)} runs made, the others were there")
    results.print_paths(written)
    return DONE
