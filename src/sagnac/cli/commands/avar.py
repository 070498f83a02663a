"""``sagnac avar``: the still bench."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

from cyclopts import Parameter

from sagnac import overwriting
from sagnac.cli import output as results
from sagnac.cli import progress as progresses
from sagnac.cli.errors import UsageError
from sagnac.cli.options import (
    ANALYSIS,
    NO_HEADING,
    NO_OPTIONS,
    Curve,
    Estimators,
    File,
    Folder,
    Force,
    Heading,
    Options,
    band,
    estimators_of,
    one_argument,
    settings_of,
    statement_of,
    title_block_of,
)
from sagnac.cli.progress import Progress
from sagnac.cli.reading import ReadFile, naming, read_file
from sagnac.cli.settings_file import inputs, settings_text, with_settings

if TYPE_CHECKING:
    from sagnac.analysis.result import Analysis
    from sagnac.analysis.settings import Settings
    from sagnac.analysis.still_bench import AtRest
    from sagnac.coefficients.self_noise import SelfNoise
    from sagnac.recording.model import Recording
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
    self_noise: Annotated[
        tuple[float, float] | None,
        one_argument(
            band,
            group=ANALYSIS,
            metavar="LOW:HIGH",
            help="Also the noise of each of three or more parallel gyros without what all of them "
            "turn, from their cross spectra; N of each over this band, Hz.",
        ),
    ] = None,
    heading: Heading = NO_HEADING,
    curve: Curve = False,
    output: Folder = None,
    force: Force = False,
) -> int:
    """The still bench: the ARW of each gyro, its curves, and the lines in it.

    The answer is with the lines out; curves and fits are of the recording as it is unless
    --method says what to remove; with --method none the answer is of the recording as it is, too.
    With -o, each gyro's report goes into a folder of its own beside a page of all of them, and the
    accelerometers' into another.
    """
    options, block = with_settings(options), title_block_of(heading)
    if heading.pdf:
        from sagnac.report.pdf import require_pdf

        require_pdf()
    statement = statement_of(options)
    settings = settings_of(options, method="none", estimators=estimators_of(estimator))
    results.require_writable(output)
    with progresses.shown() as progress:
        read = read_file(file, statement, progress, memory=options.memory, verify=gaps == "reject")
        if output is not None:
            reads = inputs([file], options, heading.heading)
            for one in _outputs(read, settings, output):
                overwriting.require_free(one, reads, force=force)
        with naming(file, read.recording):
            if gaps == "omit":
                from sagnac.recording.gaps import with_gaps_marked

                read = replace(read, recording=with_gaps_marked(read.recording))
            alone = None if self_noise is None else _alone(read, settings, self_noise)
            made = _made(read, settings, progress, lines_in=options.method == "none")
            paths: list[Path] = []
            if output is not None:
                made, paths = _reported(
                    made, output, progress, block, settings_text(options), pdf=heading.pdf,
                    force=force,
                )  # fmt: skip
                if alone is not None:
                    paths.append(_drawn(alone, output))
    if options.as_json:
        analyses = made.analysis.each
        single = not made.analysis.gyros
        beside = None
        if alone is not None:
            from sagnac.report.self_noise import self_noise_data

            beside = self_noise_data(alone)
        results.print_documents(analyses, single=single, unit=made.analysis, beside=beside)
        return results.verdict_status([made.analysis])
    for name, bench in made.benches.items():
        _print(bench, made.analysis.gyros.get(name, made.analysis), curve or estimator is not None)
    if alone is not None and self_noise is not None:
        from sagnac.report.self_noise import self_noise_text

        print(self_noise_text(alone, self_noise), end="\n\n")
    results.print_beside(made.analysis)
    results.print_paths(paths)
    results.print_closing([("", made.analysis)])
    return results.verdict_status([made.analysis])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Made:
    """Result of the still bench: all gyros, and each with its lines in and out."""

    analysis: "Analysis"
    benches: "Mapping[str, AtRest]"


def _made(read: ReadFile, settings: "Settings", progress: Progress, *, lines_in: bool) -> _Made:
    """One gyro after another, and the accelerometers.

    With `lines_in` the answer is of the recording as it is, since that was asked for.
    """
    from sagnac.analysis.alone import gyros_alone
    from sagnac.analysis.pipeline import accelerometers_of
    from sagnac.analysis.still_bench import at_rest

    benches: dict[str, AtRest] = {}

    def run(
        recording: "Recording", chosen: "Settings", /, *, progress: Progress | None = None
    ) -> "Analysis":
        bench = at_rest(recording, chosen, progress=progress, lines_in=lines_in)
        analysis = bench.analysis.with_seconds(read.seconds)
        (name,) = chosen.gyros
        benches[name] = replace(bench, analysis=analysis)
        return analysis

    def run_force(
        recording: "Recording", chosen: "Settings", /, *, progress: Progress | None = None
    ) -> "Analysis":
        return at_rest(recording, chosen, progress=progress).analysis

    still = replace(read.recording, table=None, null_pulse=None)
    names = settings.gyros_of(still)
    settings = replace(settings, gyros=names)
    if len(names) == 1:
        analysis = run(still, settings, progress=progresses.prefixed(progress, names[0]))
    else:
        analysis = gyros_alone(still, settings, run, progress)
    forces = accelerometers_of(still, settings, run=run_force, progress=progress)
    return _Made(analysis=analysis.with_accelerometers(forces), benches=benches)


def _alone(read: ReadFile, settings: "Settings", band: tuple[float, float]) -> "SelfNoise":
    """The noise of each gyro without what all of them turn.

    Raises
    ------
    UsageError
        If there are too few gyros.
    """
    from sagnac.coefficients.self_noise import self_noise

    try:
        return self_noise(
            read.recording,
            gyros=settings.gyros_of(read.recording),
            band=band,
            confidence=settings.confidence,
        )
    except ValueError as error:
        raise UsageError(f"--self-noise: {error}") from None


def _drawn(alone: "SelfNoise", folder: Path) -> Path:
    from sagnac.report.figures import write_png
    from sagnac.report.self_noise import self_noise_figure

    path = folder / "self_noise.png"
    write_png(self_noise_figure(alone), path)
    return path


def _outputs(read: ReadFile, settings: "Settings", output: Path) -> list[overwriting.Outputs]:
    """Places to be written: a folder for each gyro beside the page of all, and the forces'."""
    names = settings.gyros or tuple(gyro.name for gyro in read.recording.gyros)
    from sagnac.report.files import folder_name

    made = [overwriting.of_report(output / folder_name(name)) for name in names]
    if len(names) > 1:
        made.append(overwriting.of_report(output))
    if read.recording.accelerometers:
        made.append(overwriting.of_accelerometers(output / _ACCELEROMETERS))
    return made


def _reported(
    made: _Made,
    output: Path,
    progress: Progress,
    block: "TitleBlock",
    settings: str,
    *,
    pdf: bool,
    force: bool,
) -> tuple[_Made, list[Path]]:
    """The benches with the time of their reports, and every file written.

    One gyro's report goes into a folder of its own, too.
    """
    results.ready_to_draw()
    from sagnac.report.files import folder_name
    from sagnac.report.folder import write_report

    analysis = made.analysis
    place = output
    if not analysis.gyros:
        place = output / folder_name(analysis.channel)
    progress("report", 0.0)
    written = write_report(
        analysis, place, block=block, settings=settings, pdf=pdf, with_forces=False, force=force
    )
    paths = list(written.paths)
    if analysis.accelerometers:
        progress("accelerometers: report", 0.0)
        paths += results.write_accelerometers(analysis, output / _ACCELEROMETERS, pdf=pdf)
    return replace(made, analysis=written.analysis), paths


def _print(bench: "AtRest", analysis: "Analysis", curve: bool) -> None:
    """One gyro."""
    from sagnac.report import text

    print(text.answer(analysis))
    if bench.as_it_is is not bench.without_lines and analysis.lines:
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
