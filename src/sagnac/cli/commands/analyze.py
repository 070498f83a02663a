"""``sagnac analyze``: recordings in, reports out."""

from pathlib import Path
from typing import TYPE_CHECKING

from sagnac import overwriting
from sagnac.cli import output as results
from sagnac.cli import progress as progresses
from sagnac.cli.errors import DONE, explain
from sagnac.cli.options import (
    NO_HEADING,
    NO_OPTIONS,
    Curve,
    Files,
    Folder,
    Force,
    Heading,
    Options,
    settings_of,
    statement_of,
    title_block_of,
)
from sagnac.cli.reading import naming, read_file
from sagnac.cli.settings_file import inputs, settings_text, with_settings

if TYPE_CHECKING:
    from sagnac.analysis.result import Analysis
    from sagnac.analysis.settings import Settings
    from sagnac.formats import Statement
    from sagnac.report.folder import Report
    from sagnac.report.title_block import TitleBlock


def analyze(
    files: Files,
    /,
    *,
    options: Options = NO_OPTIONS,
    heading: Heading = NO_HEADING,
    curve: Curve = False,
    output: Folder = None,
    force: Force = False,
) -> int:
    """A recording in; report.html, analysis.json, tables and figures out.

    They go into DIR (several files: a folder each in it), by default NAME-report; with
    --json and no DIR nothing is written.
    """
    options, block = with_settings(options), title_block_of(heading)
    if heading.pdf:
        from sagnac.report.pdf import require_pdf

        require_pdf()
    statement = statement_of(options)
    settings = settings_of(options)
    folders = results.folders_of(files, output, as_json=options.as_json)
    reads = inputs(files, options, heading.heading)
    for folder in folders:
        results.require_writable(folder)
        if folder is not None:
            overwriting.require_free(overwriting.of_report(folder), reads, force=force)
    several = len(files) > 1
    done: list[Analysis] = []
    named: list[tuple[str, Analysis]] = []
    failed = DONE
    for file, folder in zip(files, folders, strict=True):
        try:
            analysis = _analyzed(
                file,
                statement,
                settings,
                stage_of=file.name * several,
                memory=options.memory,
            )
            one = _reported(
                analysis, folder, block, settings_text(options), pdf=heading.pdf, force=force
            )
        except Exception as error:
            if not several or options.debug:
                raise
            failed = max(failed, explain(error))
            continue
        done.append(one.analysis)
        named.append((file.name, one.analysis))
        if not options.as_json:
            if several:
                print(file, end="\n\n")
            _print(one, curve=curve, end="\n\n\n" if several else "\n")
    if several and not options.as_json:
        results.print_closing(named)
    if options.as_json and done:
        results.print_documents(done, single=not several)
    return failed or results.verdict_status(done)


def _analyzed(
    file: Path,
    statement: "Statement",
    settings: "Settings",
    *,
    stage_of: str,
    memory: int | None,
) -> "Analysis":
    """One file."""
    with progresses.shown(stage_of) as progress:
        read = read_file(file, statement, progress, memory=memory)
        from sagnac.analysis.pipeline import analyze as run

        with naming(file, read.recording):
            return run(read.recording, settings, progress=progress).with_seconds(read.seconds)


def _reported(
    analysis: "Analysis",
    folder: Path | None,
    block: "TitleBlock",
    settings: str,
    *,
    pdf: bool,
    force: bool,
) -> "Report":
    """The analysis with its report in `folder`, unless that is None."""
    results.ready_to_draw()
    from sagnac.report.folder import Report, write_report

    if folder is None:
        return Report(analysis=analysis, paths=())
    with progresses.shown() as progress:
        progress("report", 0.0)
        return write_report(analysis, folder, block=block, settings=settings, pdf=pdf, force=force)


def _print(one: "Report", *, curve: bool, end: str) -> None:
    from sagnac.report import text

    analysis = one.analysis
    for gyro in analysis.each:
        shown = results.in_full(gyro) if curve else results.in_brief(gyro)
        print(text.blocks(text.answer(gyro), text.verdict(gyro), *shown), end="\n\n")
    results.print_beside(analysis)
    results.print_paths(one.paths)
    if analysis.gyros:
        results.print_closing([("", analysis)], end="\n\n")
    print(text.seconds(analysis), end=end)
