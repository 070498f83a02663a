"""The ``sagnac`` command: arguments, progress and exit codes; no science.

Exit status: 0 done; 1 an error in the data, in one line; 2 wrong usage; 130 interrupted.
What takes time to import is imported by the command that needs it, so that ``--help``
and wrong usage answer at once.
"""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TextIO, get_args

from cyclopts import App, CycloptsError, Group, Parameter

from sagnac import __version__

if TYPE_CHECKING:
    from sagnac.analysis.result import Analysis
    from sagnac.analysis.settings import Method, Settings
    from sagnac.formats import Statement
    from sagnac.recording.model import Recording
    from sagnac.stability.estimators import Estimator

DONE: Final = 0
DATA_ERROR: Final = 1
USAGE_ERROR: Final = 2
INTERRUPTED: Final = 130

# What takes less than this needs no progress.
_PATIENCE_S: Final = 1.0
_METHODS: Final = ("none", "fris", "fos-paper", "fos")
_QUICK_S: Final = 900.0

_READING: Final = Group("What the file does not say", sort_key=1)
_ANALYSIS: Final = Group("Analysis", sort_key=2)
_OUTPUT: Final = Group("Output", sort_key=3)


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What is stated of a file from outside, as typed."""

    gyros: Annotated[
        str | None,
        Parameter(group=_READING, metavar="x,z", help="Gyros: one, a pair to difference, a triad."),
    ] = None
    kind: Annotated[
        str | None,
        Parameter(
            group=_READING,
            metavar="KIND",
            help="What a gyro sample is: angle, increment or rate; x=rate,z=angle one by one.",
        ),
    ] = None
    unit: Annotated[
        str | None,
        Parameter(
            group=_READING,
            metavar="UNIT",
            help="Unit of the gyros: arcsec, deg, rad, deg/s, deg/h, rad/s, counts.",
        ),
    ] = None
    scale: Annotated[
        str | None, Parameter(group=_READING, metavar="0.1arcsec", help="Size of one count.")
    ] = None
    rate: Annotated[
        float | None, Parameter(group=_READING, metavar="HZ", help="Samples per second.")
    ] = None
    time: Annotated[
        str | None,
        Parameter(group=_READING, metavar="COLUMN[:UNIT]", help="Time stamps; none for no stamps."),
    ] = None
    table: Annotated[
        str | None,
        Parameter(group=_READING, metavar="COLUMN[:UNIT]", help="Its encoder; none for no table."),
    ] = None
    columns: Annotated[
        str | None,
        Parameter(group=_READING, metavar="x=NAME,z=NAME", help="Columns that hold the gyros."),
    ] = None
    slice: Annotated[
        str | None,
        Parameter(group=_READING, metavar="START:STOP", help="Span to take, s from the start."),
    ] = None
    counter_bits: Annotated[
        int | None,
        Parameter(group=_READING, metavar="BITS", help="Width of counters that roll over."),
    ] = None
    null_pulse: Annotated[
        str | None,
        Parameter(group=_READING, metavar="COLUMN", help="Column that is not 0 at the null pulse."),
    ] = None
    debug: Annotated[
        bool,
        Parameter(group=_OUTPUT, negative="", show_default=False, help="Traceback on errors."),
    ] = False


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Options(Reading):
    """The options that all commands share which look into a recording."""

    method: Annotated[
        Literal["fos", "fos-paper", "fris", "none"] | None,
        Parameter(group=_ANALYSIS, help="How periodic parts are removed: fos unless stated."),
    ] = None
    interval: Annotated[
        str | None,
        Parameter(
            group=_ANALYSIS,
            metavar="1s",
            help="Between the angles of the curve: 1s unless stated; every sample in avar.",
        ),
    ] = None
    confidence: Annotated[
        float, Parameter(group=_ANALYSIS, metavar="0.95", help="Of every interval.")
    ] = 0.95
    as_json: Annotated[
        bool,
        Parameter(
            name="--json",
            group=_OUTPUT,
            negative="",
            show_default=False,
            help="The analysis on standard output, nothing else there.",
        ),
    ] = False


_NO_STATEMENT: Final = Reading()
_NO_OPTIONS: Final = Options()

Files = Annotated[list[Path], Parameter(name="FILE", help="Recordings.")]
File = Annotated[Path, Parameter(name="FILE", help="A recording.")]
Folder = Annotated[
    Path | None, Parameter(name=["-o", "--output"], group=_OUTPUT, metavar="DIR", help="Folder.")
]
Debug = Annotated[
    bool, Parameter(group=_OUTPUT, negative="", show_default=False, help="Traceback on errors.")
]

app: Final = App(
    name="sagnac",
    version=__version__,
    help="The angle random walk of a gyro, at rest or on a turning table, with an interval.",
    help_format="plaintext",
)


class UsageError(Exception):
    """Wrong usage that the argument parser cannot see."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments
        Without the program's name; those of the process by default.

    Returns
    -------
    int
        Exit status.
    """
    tokens = list(sys.argv[1:] if arguments is None else arguments)
    # The fits are thousands of small factorizations, which linear algebra on several threads
    # only slows: tenfold where other work shares the cores. Read when numpy is first imported.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("MKL_NUM_THREADS", "1")
    for stream in (sys.stdout, sys.stderr):
        # A terminal that lacks ″ or √ shows a ? there rather than failing.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    debug = "--debug" in tokens
    try:
        command, bound, _ = app.parse_args(tokens, exit_on_error=False, print_error=False)
        status = command(*bound.args, **bound.kwargs)
        sys.stdout.flush()
    except KeyboardInterrupt:
        _complain("interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output has left; give the interpreter nowhere to fail at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except CycloptsError as error:
        chain = " ".join(["sagnac", *(error.command_chain or ())])
        _complain(f"{_one_line(error)} See {chain} --help")
        return USAGE_ERROR
    except Exception as error:
        if debug:
            raise
        return _explain(error)
    return status if isinstance(status, int) else DONE


@app.command
def demo(
    *,
    output: Folder = None,
    quick: Annotated[
        bool, Parameter(negative="", show_default=False, help="A quarter of an hour only.")
    ] = False,
    seed: Annotated[int, Parameter(metavar="N", help="Of the simulation.")] = 1,
    debug: Debug = False,
) -> int:
    """Simulate the paper's two-hour run, analyze it, print the ARW beside the truth."""
    del debug
    folder = _folder(output or Path("demo"))
    from sagnac.rig.config import preset
    from sagnac.rig.sections import GYRO_NAMES
    from sagnac.rig.simulate import write

    config = replace(preset("paper"), seed=seed)
    if quick:
        config = replace(config, duration_s=_QUICK_S)
    from sagnac.analysis.pipeline import analyze
    from sagnac.analysis.settings import Settings
    from sagnac.formats import read
    from sagnac.report import text

    began = time.perf_counter()
    with _progress() as progress:
        path, truth_path = write(
            config, folder / "recording.parquet", lambda part: progress("simulate", part)
        )
        simulated = time.perf_counter()
        progress("read", 0.0)
        recording = read(path)
        read_s = time.perf_counter() - simulated
        analysis = analyze(recording, Settings(gyros=tuple(GYRO_NAMES)), progress=progress)
        analysis = _with_seconds(analysis, {"simulate": simulated - began, "read": read_s})
        progress("report", 0.0)
        analysis, written = _write_all(analysis, folder)
    truth = json.loads(truth_path.read_text(encoding="utf-8"))
    put_in = float(truth["pairs"][analysis.channel]["arw_deg_per_sqrt_h"])
    print(text.answer(analysis))
    print(text.beside_truth(analysis, put_in), end="\n\n")
    _print_paths([path, truth_path, *written])
    print(text.seconds(analysis))
    return DONE


@app.command
def analyze(files: Files, /, *, options: Options = _NO_OPTIONS, output: Folder = None) -> int:
    """A recording in; report.html, analysis.json, tables and figures out.

    They go into DIR (several files: a folder each in it), by default NAME-report; with
    --json and no DIR nothing is written.
    """
    statement = _statement(options)
    _settings(options, ("x",))
    folders = _folders(files, output, options)
    for folder in folders:
        _require_writable(folder)
    done: list[Analysis] = []
    failed = DONE
    for file, folder in zip(files, folders, strict=True):
        try:
            written: list[Path] = []
            named = file.name if len(files) > 1 else ""
            with _naming(file), _progress(named) as progress:
                recording, seconds = _read(file, statement, progress)
                settings = _settings(options, _gyros(options, recording))
                from sagnac.analysis.pipeline import analyze as run

                analysis = run(recording, settings, progress=progress)
                analysis = _with_seconds(analysis, seconds)
                if folder is not None:
                    progress("report", 0.0)
                    analysis, written = _write_all(analysis, _folder(folder))
        except Exception as error:
            if len(files) == 1 or options.debug:
                raise
            failed = max(failed, _explain(error))
            continue
        done.append(analysis)
        if not options.as_json:
            from sagnac.report import text

            if len(files) > 1:
                print(file, end="\n\n")
            print(
                text.blocks(
                    text.answer(analysis),
                    text.coefficients(analysis),
                    text.units(analysis),
                    text.lines(analysis),
                    text.notes(analysis.notes),
                ),
                end="\n\n",
            )
            _print_paths(written)
            print(text.seconds(analysis), end="\n\n\n" if file != files[-1] else "\n")
    if options.as_json and done:
        _print_documents(done, single=len(files) == 1)
    return failed


@app.command
def avar(
    file: File,
    /,
    *,
    options: Options = _NO_OPTIONS,
    estimator: Annotated[
        list[str] | None,
        Parameter(
            group=_ANALYSIS,
            metavar="NAME,…",
            negative="",
            help="Curves: oadev (unless stated), adev, mdev, tdev, hdev, ohdev, totdev, mtotdev, "
            "theo1, theoh, haar; several with commas between, or given again.",
        ),
    ] = None,
    gaps: Annotated[
        Literal["reject", "omit"],
        Parameter(
            group=_ANALYSIS,
            help="Missing samples (NaN, jumps of the time stamps): an error that says where, or "
            "terms that touch one are left out, counted and noted.",
        ),
    ] = "reject",
    output: Folder = None,
) -> int:
    """The still bench: curves and coefficients of each gyro as it is, and the lines in it.

    Coefficients are of the recording as it is unless --method says what to remove; the
    lines are listed either way. With -o, each gyro's report goes into a folder of its own.
    """
    statement = _statement(options)
    _settings(options, ("x",), method="none", interval=None)
    estimators = _estimators(estimator)
    _require_writable(output)
    analyses: list[Analysis] = []
    cleaned: list[Analysis] = []
    written: list[Path] = []
    with _naming(file), _progress() as progress:
        recording, seconds = _read(file, statement, progress, verify=gaps == "reject")
        from sagnac.analysis.still import at_rest
        from sagnac.recording.gaps import with_gaps_marked

        if gaps == "omit":
            recording = with_gaps_marked(recording)
        for name in _gyros(options, recording):
            settings = _settings(options, (name,), method="none", interval=None)
            named = _prefixed(progress, name)
            both = at_rest(recording, replace(settings, estimators=estimators), progress=named)
            analysis, searched = both.analysis, both.without_lines
            analysis = _with_seconds(analysis, seconds)
            if output is not None:
                named("report", 0.0)
                analysis, paths = _write_all(analysis, _folder(output / name))
                written += paths
            analyses.append(analysis)
            cleaned.append(searched)
    if options.as_json:
        _print_documents(analyses, single=len(analyses) == 1)
        return DONE
    from sagnac.report import text

    for analysis, searched in zip(analyses, cleaned, strict=True):
        print(text.answer(analysis))
        if analysis.settings.method == "none" and searched.lines:
            print(text.without_lines(searched))
        print()
        print(
            text.blocks(
                *(text.curve(analysis, curve) for curve in analysis.family),
                text.density(analysis),
                text.coefficients(analysis),
                text.units(analysis),
                text.lines(analysis),
                text.notes(analysis.notes),
                text.seconds(analysis),
            ),
            end="\n\n",
        )
    _print_paths(written)
    return DONE


@app.command
def lines(file: File, /, *, options: Options = _NO_OPTIONS) -> int:
    """The periodic components found, strongest first."""
    statement = _statement(options)
    _settings(options, ("x",))
    with _naming(file), _progress() as progress:
        recording, seconds = _read(file, statement, progress)
        from sagnac.analysis.pipeline import analyze as run

        settings = _settings(options, _gyros(options, recording))
        analysis = _with_seconds(run(recording, settings, progress=progress), seconds)
    if options.as_json:
        _print_documents([analysis], single=True)
        return DONE
    from sagnac.report import text

    print(text.blocks(text.lines(analysis, most=None), text.notes(analysis.notes)))
    return DONE


@app.command
def compare(file: File, /, *, options: Options = _NO_OPTIONS, output: Folder = None) -> int:
    """No removal, fris, fos-paper and fos, side by side; with -o also as a page.

    --method picks one to run alone.
    """
    statement = _statement(options)
    _settings(options, ("x",))
    _require_writable(output)
    analyses: dict[str, Analysis] = {}
    refused: dict[str, str] = {}
    written: list[Path] = []
    with _naming(file), _progress() as progress:
        recording, seconds = _read(file, statement, progress)
        from sagnac.analysis.pipeline import analyze as run
        from sagnac.errors import RecordingError

        names = _gyros(options, recording)
        chosen: Sequence[Method] = (options.method,) if options.method else _METHODS
        for method in chosen:
            settings = _settings(options, names, method=method)
            try:
                analyses[method] = run(recording, settings, progress=_prefixed(progress, method))
            except RecordingError as error:
                refused[method] = str(error)
        if not analyses:
            raise RecordingError(next(iter(refused.values())))
        analyses = {method: _with_seconds(one, seconds) for method, one in analyses.items()}
        if output is not None:
            progress("report", 0.0)
            written = _write_comparison(analyses, refused, _folder(output))
    from sagnac.report import text
    from sagnac.report.document import comparison_document, to_json

    if options.as_json:
        print(to_json(comparison_document(analyses, refused)))
        return DONE
    print(f"{file}: {text.comparison(analyses, refused)}")
    _print_paths(written)
    return DONE


@app.command
def check(file: File, /, *, options: Options = _NO_OPTIONS) -> int:
    """Data quality: gaps, jumps, wraps, stuck channels, units that look wrong.

    Exit status 1 where an error was found.
    """
    statement = _statement(options)
    with _naming(file), _progress() as progress:
        recording, _ = _read(file, statement, progress, verify=False)
        from sagnac.recording.quality import check as findings_of

        progress("check", 0.0)
        findings = findings_of(recording)
    from sagnac.errors import worded

    errors = [finding for finding in findings if finding.level == "error"]
    if options.as_json:
        document = {
            "schema": "sagnac.check/1",
            "version": __version__,
            "input": {
                "path": str(file),
                "sha256": recording.provenance.sha256 if recording.provenance else None,
                "samples": recording.samples,
                "sample_rate_hz": recording.sample_rate,
                "gyros": [channel.name for channel in recording.gyros],
                "table": recording.table is not None,
            },
            "findings": [
                {"level": item.level, "channel": item.channel, "message": worded(item.text)}
                for item in findings
            ],
            "notes": [str(note) for note in recording.notes],
        }
        print(json.dumps(document, allow_nan=False, indent=1))
    else:
        from sagnac.report import text

        print(
            text.blocks(
                text.recording(recording), text.findings(findings), text.notes(recording.notes)
            )
        )
    if errors:
        where = f"{errors[0].channel}: " if errors[0].channel else ""
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        _complain(f"{file}: {where}{worded(errors[0].text)}{more}")
        return DATA_ERROR
    return DONE


@app.command
def simulate(
    config: Annotated[Path | None, Parameter(name="CONFIG.toml", help="What differs.")] = None,
    /,
    *,
    output: Annotated[
        Path,
        Parameter(name=["-o", "--output"], group=_OUTPUT, metavar="FILE", help="The recording."),
    ],
    preset: Annotated[
        Literal["quiet", "paper", "harsh"] | None,
        Parameter(help="What to start from without a CONFIG.toml: paper unless stated."),
    ] = None,
    seed: Annotated[int | None, Parameter(metavar="N", help="Of every random stream.")] = None,
    table_rate: Annotated[
        float | None, Parameter(metavar="DEG/S", help="Rate of the table; 0 is at rest.")
    ] = None,
    duration: Annotated[
        str | None, Parameter(metavar="2h", help="Length of the recording; s unless stated.")
    ] = None,
    debug: Debug = False,
) -> int:
    """Simulate a rig recording into FILE, its truth beside it as FILE.truth.json."""
    del debug
    if config is not None and preset is not None:
        raise UsageError("--preset and CONFIG.toml exclude each other; write preset in the TOML")
    seconds = None if duration is None else _seconds("--duration", duration)
    from sagnac.errors import RecordingError
    from sagnac.rig.config import RigConfig
    from sagnac.rig.config import preset as preset_of
    from sagnac.rig.simulate import write

    if config is None:
        chosen = preset_of(preset or "paper")
    else:
        try:
            chosen = RigConfig.from_toml(config)
        except ValueError as error:
            raise RecordingError(str(error)) from None
    if seed is not None:
        chosen = replace(chosen, seed=seed)
    if seconds is not None:
        chosen = replace(chosen, duration_s=seconds)
    if table_rate is not None:
        if chosen.table.profile:
            raise UsageError("--table-rate has no effect on a table.profile; remove one of them")
        chosen = replace(chosen, table=replace(chosen.table, rate_deg_per_s=table_rate))
    with _progress() as progress:
        path, truth_path = write(chosen, output, lambda part: progress("simulate", part))
    print(f"{chosen.samples} samples at {chosen.sample_rate_hz:g} Hz, seed {chosen.seed}")
    _print_paths([path, truth_path])
    return DONE


@app.command
def convert(
    source: Annotated[Path, Parameter(name="IN", help="A recording.")],
    target: Annotated[Path, Parameter(name="OUT", help="Its suffix says the format.")],
    /,
    *,
    options: Reading = _NO_STATEMENT,
) -> int:
    """Read a recording and write it so that reading it again needs no option."""
    statement = _statement(options)
    if target.exists() and source.exists() and target.samefile(source):
        raise UsageError(f"{target}: is IN itself, which would be lost; give OUT another name")
    with _progress() as progress:
        recording, _ = _read(source, statement, progress)
        from sagnac.formats import write

        progress("write", 0.0)
        written = write(recording, target)
    from sagnac.report import text

    print(text.blocks(text.recording(recording), text.notes(recording.notes)))
    _print_paths([written])
    return DONE


@app.command
def reproduce(
    *,
    output: Folder = None,
    quick: Annotated[
        bool, Parameter(negative="", show_default=False, help="Tables of half an hour, not 2 h.")
    ] = False,
    debug: Debug = False,
) -> int:
    """The paper's Figures 2 to 6 and Tables 1 and 2 on the simulated rig, truth beside.

    Page, pictures and tables go into DIR, by default reproduction. Started again in the
    same folder it goes on where it stopped.
    """
    del debug
    folder = _folder(output or Path("reproduction"))
    _require_writable(folder)
    from sagnac.paper.plan import QUICK, Scope
    from sagnac.paper.reproduce import reproduce as make
    from sagnac.report import reproduction as pages

    with _progress() as progress:
        made = make(folder, QUICK if quick else Scope(), progress=progress)
        progress("page", 0.0)
        written = pages.write(made, folder)
    print(pages.summary(made), end="\n\n")
    print(f"{made.computed} of {len(made.outcomes)} runs made, the others were there")
    _print_paths(written)
    return DONE


# ---- from what was typed -------------------------------------------------------------


def _statement(options: Reading) -> "Statement":
    from sagnac.formats import Statement

    return Statement(
        gyros=_list("--gyros", options.gyros),
        kind=_one_or_by_name("--kind", options.kind),
        unit=_one_or_by_name("--unit", options.unit),
        scale=options.scale,
        sample_rate=options.rate,
        time=options.time,
        table=options.table,
        columns={} if options.columns is None else _by_name("--columns", options.columns),
        span=_span(options.slice),
        counter_bits=options.counter_bits,
        null_pulse=options.null_pulse,
    )


def _settings(
    options: Options,
    gyros: tuple[str, ...],
    *,
    method: "Method" = "fos",
    interval: float | None = 1.0,
) -> "Settings":
    """Settings with this command's own defaults for what was not typed."""
    from sagnac.analysis.settings import Settings

    if not 0.0 < options.confidence < 1.0:
        raise UsageError(
            f"--confidence {options.confidence:g}: give a number between 0 and 1, such as 0.95"
        )
    return Settings(
        gyros=gyros,
        method=options.method or method,
        interval=(
            interval if options.interval is None else _seconds("--interval", options.interval)
        ),
        confidence=options.confidence,
    )


def _gyros(options: Reading, recording: "Recording") -> tuple[str, ...]:
    stated = _list("--gyros", options.gyros)
    return stated or tuple(channel.name for channel in recording.gyros)


def _estimators(stated: Sequence[str] | None) -> "tuple[Estimator, ...]":
    from sagnac.stability.estimators import Estimator

    known = get_args(Estimator)
    names = [name for text in stated or ["oadev"] for name in _list("--estimator", text) or ()]
    for name in names:
        if name not in known:
            raise UsageError(f"--estimator {name}: is not known; use {', '.join(known)}")
    return tuple(name for name in known if name in names)


def _list(option: str, text: str | None) -> tuple[str, ...] | None:
    if text is None:
        return None
    names = tuple(name.strip() for name in text.split(","))
    if "" in names:
        raise UsageError(f"{option} {text}: give names with commas between them, such as x,z")
    return names


def _one_or_by_name(option: str, text: str | None) -> str | Mapping[str, str] | None:
    return _by_name(option, text) if text is not None and "=" in text else text


def _by_name(option: str, text: str) -> dict[str, str]:
    pairs = [item.partition("=") for item in text.split(",")]
    if any(not name.strip() or not value.strip() for name, _, value in pairs):
        raise UsageError(f"{option} {text}: give NAME=VALUE with commas between, such as x=A,z=B")
    return {name.strip(): value.strip() for name, _, value in pairs}


def _span(text: str | None) -> tuple[float | None, float | None] | None:
    if text is None:
        return None
    start, colon, stop = text.partition(":")
    try:
        if not colon:
            raise ValueError
        return (float(start) if start.strip() else None, float(stop) if stop.strip() else None)
    except ValueError:
        raise UsageError(f"--slice {text}: give START:STOP in s, such as 630:930") from None


def _seconds(option: str, text: str) -> float:
    """``1``, ``1s``, ``100ms`` or ``2h`` in s."""
    from sagnac.units import time_scale

    number = text.strip().rstrip("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ").strip()
    unit = text.strip()[len(number) :].strip() or "s"
    try:
        value = float(number) * time_scale(unit)
    except ValueError:
        value = float("nan")
    if not 0.0 < value < float("inf"):
        raise UsageError(f"{option} {text}: give a time above zero such as 1s, 100ms or 2h")
    return value


def _folders(files: Sequence[Path], output: Path | None, options: Options) -> list[Path | None]:
    """Where the results of each file go; None for nowhere."""
    if output is None and options.as_json:
        return [None] * len(files)
    if len(files) == 1 and output is not None:
        return [output]
    taken: set[Path] = set()
    folders: list[Path | None] = []
    for file in files:
        folder = output / file.stem if output else Path(f"{file.stem}-report")
        if folder in taken:
            folder = folder.with_name(f"{folder.name}-{len(taken) + 1}")
        taken.add(folder)
        folders.append(folder)
    return folders


# ---- doing ---------------------------------------------------------------------------


def _read(
    file: Path,
    statement: "Statement",
    progress: Callable[[str, float], None],
    *,
    verify: bool = True,
) -> tuple["Recording", dict[str, float]]:
    from sagnac.formats import read

    began = time.perf_counter()
    progress("read", 0.0)
    recording = read(file, statement, verify=verify)
    progress("read", 1.0)
    return recording, {"read": time.perf_counter() - began}


@contextmanager
def _naming(file: Path) -> Iterator[None]:
    """Put the file before a data error of a stage that knows nothing of files."""
    from sagnac.errors import RecordingError

    try:
        yield
    except RecordingError as error:
        if str(file) in str(error):
            raise
        raise RecordingError(f"{file}: {error}") from error


def _with_seconds(analysis: "Analysis", before: Mapping[str, float]) -> "Analysis":
    """The analysis with the time of what was done before it in front."""
    return replace(analysis, seconds={**before, **analysis.seconds})


def _require_writable(folder: Path | None) -> None:
    """Refuse a folder that cannot be written to before the work, and make nothing yet."""
    from sagnac.errors import RecordingError

    if folder is None:
        return
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        why = "is no folder" if not there.is_dir() else "may not be written to"
        raise RecordingError(f"{folder}: {there} {why}; choose another folder (-o)")


def _folder(folder: Path) -> Path:
    from sagnac.errors import RecordingError

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(
            f"{folder}: cannot be made ({error.strerror}); choose another folder (-o)"
        ) from None
    return folder


def _write_all(analysis: "Analysis", folder: Path) -> tuple["Analysis", list[Path]]:
    """Report, document, tables and figures into `folder`; and how long the figures took."""
    from sagnac.report import document, figures, page

    began = time.perf_counter()
    figures.write_png(figures.stability_figure(analysis), folder / "stability.png")
    figures.write_png(figures.spectrum_figure(analysis), folder / "spectrum.png")
    document.write_text(folder / "stability.csv", document.stability_table(analysis))
    document.write_text(folder / "lines.csv", document.line_table(analysis))
    page.write_report(analysis, folder / "report.html")
    spent = time.perf_counter() - began
    analysis = replace(analysis, seconds={**analysis.seconds, "report": spent})
    text = document.to_json(document.analysis_document(analysis))
    document.write_text(folder / "analysis.json", text + "\n")
    names = ["report.html", "analysis.json", "stability.csv", "lines.csv"]
    if analysis.family:
        document.write_text(folder / "family.csv", document.family_table(analysis))
        document.write_text(folder / "psd.csv", document.density_table(analysis))
        names += ["family.csv", "psd.csv"]
    return analysis, [folder / name for name in (*names, "stability.png", "spectrum.png")]


def _write_comparison(
    analyses: "Mapping[str, Analysis]", refused: Mapping[str, str], folder: Path
) -> list[Path]:
    from sagnac.report import document, figures, page

    figures.write_png(figures.comparison_figure(analyses), folder / "comparison.png")
    document.write_text(folder / "comparison.html", page.comparison_page(analyses, refused))
    text = document.to_json(document.comparison_document(analyses, refused))
    document.write_text(folder / "comparison.json", text + "\n")
    return [folder / f"comparison.{suffix}" for suffix in ("html", "json", "png")]


# ---- progress ------------------------------------------------------------------------


@contextmanager
def _progress(prefix: str = "") -> Iterator[Callable[[str, float], None]]:
    """Progress on standard error: bars on a terminal, else a line a stage once it takes long."""
    if not sys.stderr.isatty():
        yield _prefixed(_stage_lines(sys.stderr), prefix)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    bars = Progress(
        TextColumn("{task.description:<24}"),
        BarColumn(bar_width=36),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    tasks: dict[str, Any] = {}

    def show(stage: str, fraction: float) -> None:
        if stage not in tasks:
            for task in tasks.values():
                bars.update(task, completed=1.0)
            tasks[stage] = bars.add_task(stage, total=1.0)
        bars.update(tasks[stage], completed=fraction)

    with bars:
        yield _prefixed(show, prefix)


def _stage_lines(stream: TextIO) -> Callable[[str, float], None]:
    began = time.perf_counter()
    shown: set[str] = set()

    def show(stage: str, fraction: float) -> None:
        spent = time.perf_counter() - began
        if stage in shown or spent < _PATIENCE_S or fraction >= 1.0:
            return
        shown.add(stage)
        print(f"[{spent:6.1f} s] {stage}", file=stream, flush=True)

    return show


def _prefixed(progress: Callable[[str, float], None], prefix: str) -> Callable[[str, float], None]:
    if not prefix:
        return progress
    return lambda stage, fraction: progress(f"{prefix}: {stage}", fraction)


# ---- saying --------------------------------------------------------------------------


def _explain(error: Exception) -> int:
    """One line on standard error for what went wrong; the exit status it means."""
    from sagnac.errors import RecordingError

    if isinstance(error, RecordingError):
        _complain(_one_line(error))
        return DATA_ERROR
    if isinstance(error, UsageError) or type(error) is ValueError:
        _complain(_one_line(error))
        return USAGE_ERROR
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        _complain(f"{where}{error.strerror or _one_line(error)}; check the path and its rights")
        return DATA_ERROR
    if isinstance(error, MemoryError):
        _complain("out of memory; take a part of the recording with --slice START:STOP")
        return DATA_ERROR
    _complain(
        f"internal error: {type(error).__name__}: {_one_line(error)}; "
        "run again with --debug for the traceback, and report it"
    )
    return DATA_ERROR


def _complain(message: str) -> None:
    print(f"sagnac: {message}", file=sys.stderr)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _print_documents(analyses: "Sequence[Analysis]", *, single: bool) -> None:
    from sagnac.report.document import analysis_document, many_document, to_json

    document = analysis_document(analyses[0]) if single else many_document(analyses)
    print(to_json(document))


def _print_paths(paths: Sequence[Path]) -> None:
    for path in paths:
        print(f"wrote {path}")
