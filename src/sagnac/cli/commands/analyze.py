"""``sagnac analyze``: recordings in, reports out."""

from pathlib import Path
from typing import TYPE_CHECKING

from sagnac.cli import output as results
from sagnac.cli import progress as progresses
from sagnac.cli.errors import DONE, explain
from sagnac.cli.options import NO_OPTIONS, Files, Folder, Options, settings_of, statement_of
from sagnac.cli.reading import naming, read_file, with_accelerometers

if TYPE_CHECKING:
    from sagnac.analysis.result import Analysis
    from sagnac.analysis.settings import Settings
    from sagnac.formats import Statement


def analyze(files: Files, /, *, options: Options = NO_OPTIONS, output: Folder = None) -> int:
    """A recording in; report.html, analysis.json, tables and figures out.

    They go into DIR (several files: a folder each in it), by default NAME-report; with
    --json and no DIR nothing is written.
    """
    statement = statement_of(options)
    settings = settings_of(options)
    folders = results.folders_of(files, output, as_json=options.as_json)
    for folder in folders:
        results.require_writable(folder)
    several = len(files) > 1
    done: list[Analysis] = []
    failed = DONE
    for file, folder in zip(files, folders, strict=True):
        try:
            one = _analyzed(file, statement, settings, folder, stage_of=file.name * several)
        except Exception as error:
            if not several or options.debug:
                raise
            failed = max(failed, explain(error))
            continue
        done.append(one.analysis)
        if not options.as_json:
            if several:
                print(file, end="\n\n")
            _print(one, end="\n\n\n" if file != files[-1] else "\n")
    if options.as_json and done:
        results.print_documents(done, single=not several)
    return failed


def _analyzed(
    file: Path, statement: "Statement", settings: "Settings", folder: Path | None, *, stage_of: str
) -> results.Written:
    """One file, its report in `folder` unless that is None."""
    with progresses.shown(stage_of) as progress:
        read = read_file(file, statement, progress)
        from sagnac.analysis.pipeline import analyze as run

        with naming(file):
            analysis = run(read.recording, settings, progress=progress).with_seconds(read.seconds)
            analysis = with_accelerometers(analysis, read.recording, progress)
        if folder is None:
            return results.Written(analysis=analysis, paths=())
        progress("report", 0.0)
        return results.write_report(analysis, folder)


def _print(one: results.Written, *, end: str) -> None:
    from sagnac.report import text

    analysis = one.analysis
    print(
        text.blocks(
            text.answer(analysis),
            text.coefficients(analysis),
            text.units(analysis),
            text.accelerometers(analysis.accelerometers),
            text.lines(analysis),
            text.notes(analysis.notes),
        ),
        end="\n\n",
    )
    results.print_paths(one.paths)
    print(text.seconds(analysis), end=end)
