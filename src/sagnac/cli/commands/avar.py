"""``sagnac avar``: the still bench."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

from cyclopts import Parameter

from sagnac.cli import output as results
from sagnac.cli import progress as progresses
from sagnac.cli.options import (
    ANALYSIS,
    NO_HEADING,
    NO_OPTIONS,
    Curve,
    Estimators,
    File,
    Folder,
    Heading,
    Options,
    estimators_of,
    settings_of,
    statement_of,
    title_block_of,
)
from sagnac.cli.progress import Progress
from sagnac.cli.reading import ReadFile, naming, read_file, with_accelerometers
from sagnac.cli.settings_file import settings_text, with_settings

if TYPE_CHECKING:
    from sagnac.analysis.result import Analysis
    from sagnac.analysis.settings import Settings
    from sagnac.analysis.still_bench import AtRest
    from sagnac.report.title_block import TitleBlock

# Folder of their report, beside those of the gyros.
_ACCELEROMETERS: Final = "accelerometers"


def avar(
    file: File,
    /,
    *,
    options: Options = NO_OPTIONS,
    estimator: Estimators = None,
    gaps: Annotated[
        Literal["reject", "omit"],
        Parameter(
            group=ANALYSIS,
            help="Missing samples (NaN, jumps of the time stamps): an error that says where, or "
            "terms that touch one are left out, counted and noted.",
        ),
    ] = "reject",
    heading: Heading = NO_HEADING,
    curve: Curve = False,
    output: Folder = None,
) -> int:
    """The still bench: the ARW of each gyro, its curves, and the lines in it.

    The answer is with the lines out; curves and fits are of the recording as it is unless
    --method says what to remove. With -o, each gyro's report goes into a folder of its own, and
    the accelerometers' into another.
    """
    options, block = with_settings(options), title_block_of(heading)
    if heading.pdf:
        from sagnac.report.pdf import require_pdf

        require_pdf()
    statement = statement_of(options)
    settings = settings_of(
        options, method="none", interval=None, estimators=estimators_of(estimator)
    )
    results.require_writable(output)
    with progresses.shown() as progress:
        read = read_file(file, statement, progress, memory=options.memory, verify=gaps == "reject")
        with naming(file, read.recording):
            if gaps == "omit":
                from sagnac.recording.gaps import with_gaps_marked

                read = replace(read, recording=with_gaps_marked(read.recording))
            benches = _benches(read, settings, progress)
            first = with_accelerometers(benches[0].analysis, read.recording, progress)
            benches = [replace(benches[0], analysis=first), *benches[1:]]
            paths: list[Path] = []
            if output is not None:
                benches, paths = _reported(
                    benches, output, progress, block, settings_text(options), pdf=heading.pdf
                )
    if options.as_json:
        results.print_documents([one.analysis for one in benches], single=len(benches) == 1)
        return results.verdict_status([one.analysis for one in benches])
    for bench in benches:
        _print(bench, curve=curve or estimator is not None)
    _print_accelerometers(benches[0].analysis)
    results.print_paths(paths)
    _print_closing(benches)
    return results.verdict_status([one.analysis for one in benches])


def _benches(read: ReadFile, settings: "Settings", progress: Progress) -> "list[AtRest]":
    """One gyro after another."""
    from sagnac.analysis.still_bench import at_rest

    benches = []
    for name in settings.gyros or tuple(gyro.name for gyro in read.recording.gyros):
        bench = at_rest(
            read.recording,
            replace(settings, gyros=(name,)),
            progress=progresses.prefixed(progress, name),
        )
        benches.append(replace(bench, analysis=bench.analysis.with_seconds(read.seconds)))
    return benches


def _reported(
    benches: "list[AtRest]",
    output: Path,
    progress: Progress,
    block: "TitleBlock",
    settings: str,
    *,
    pdf: bool,
) -> "tuple[list[AtRest], list[Path]]":
    """The benches with the time of their reports, and every file written."""
    timed: list[AtRest] = []
    paths: list[Path] = []
    for bench in benches:
        (name,) = bench.analysis.settings.gyros
        progress(f"{name}: report", 0.0)
        written = results.write_report(
            bench.analysis,
            output / results.folder_name(name),
            block=block,
            settings=settings,
            pdf=pdf,
            with_forces=False,
        )
        timed.append(replace(bench, analysis=written.analysis))
        paths += written.paths
    if forces := benches[0].analysis.accelerometers:
        progress("accelerometers: report", 0.0)
        paths += results.write_accelerometers(forces, output / _ACCELEROMETERS, pdf=pdf)
    return timed, paths


def _print_accelerometers(analysis: "Analysis") -> None:
    from sagnac.report import text

    if analysis.accelerometers:
        print(text.accelerometers(analysis.accelerometers), end="\n\n")


def _print(bench: "AtRest", *, curve: bool) -> None:
    from sagnac.report import text

    analysis = bench.analysis
    print(text.answer(analysis))
    if analysis.settings.method == "none" and analysis.lines:
        print(text.with_lines(bench.as_it_is))
    print()
    print(
        text.blocks(
            text.verdict(analysis),
            *(
                results.in_full(analysis)
                if curve
                else results.in_brief(analysis, (bench.without_lines, bench.as_it_is))
            ),
            text.seconds(analysis),
        ),
        end="\n\n",
    )


def _print_closing(benches: "list[AtRest]") -> None:
    from sagnac.report import brief

    shown = brief.closing([("", one.analysis) for one in benches])
    if shown:
        print(shown)
