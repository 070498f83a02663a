"""The options that several commands share, what the library is given of them, and the recording."""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from cyclopts import Group, Parameter, Token

import sagnac
from sagnac.cli.output import Progress, UsageError, progress_shown
from sagnac.core import texts
from sagnac.core.units import DEGREE, RATE_UNITS, split_factor, unit_of

if TYPE_CHECKING:
    from sagnac import Analysis, Settings
    from sagnac.report.sections import TitleBlock

READING: Final = Group("What the file does not say", sort_key=1)
ANALYSIS: Final = Group("Analysis", sort_key=2)
OUTPUT: Final = Group("Output", sort_key=3)

# Bytes in a unit of memory.
_BYTES: Final = {"": 1.0, "b": 1.0}
for _power, _prefix in enumerate("kmgt", start=1):
    _BYTES.update({f"{_prefix}b": 1000.0**_power, f"{_prefix}ib": 1024.0**_power})


# ---- from what was typed: one argument -> one value ----------------------------------


@texts.giving("LOW:HIGH in Hz, such as 0.1:5")
def band(text: str) -> tuple[float, float]:
    """``LOW:HIGH`` in Hz.

    Raises
    ------
    ValueError
        If it is none.
    """
    low, high = map(float, text.split(":"))
    if not 0.0 <= low < high:
        raise ValueError
    return low, high


@texts.giving("noise density and random walk, such as 2e-3,3e-3")
def two_numbers(text: str) -> tuple[float, float]:
    """``2e-3,3e-3`` as two numbers.

    Raises
    ------
    ValueError
        If it is none.
    """
    first, second = map(float, text.split(","))
    return first, second


@texts.giving("half widths such as 1% or 0.01")
def half_width(text: str) -> float:
    """``5%`` or ``0.05`` as a share.

    Raises
    ------
    ValueError
        If it is not between 0 and 1.
    """
    width = float(text.strip().removesuffix("%")) * (0.01 if "%" in text else 1.0)
    if not 0.0 < width < 1.0:
        raise ValueError
    return width


def several(convert: Callable[[str], texts.Value]) -> Callable[[str], tuple[texts.Value, ...]]:
    """Converts each of some texts with commas between: ``60s,10min``."""
    return lambda text: tuple(convert(part) for part in text.split(","))


@texts.giving("an angle above zero such as 2deg or 30arcmin")
def angle(text: str) -> float:
    """``2deg`` or ``30arcmin`` in rad.

    Raises
    ------
    ValueError
        If it is no angle above zero with its unit.
    """
    return unit_of(texts.numbered(text.strip()), "angle").size


@texts.giving("a number of degrees")
def degrees(text: str) -> float:
    """``32.5`` in degrees (a second) in rad (/s).

    Raises
    ------
    ValueError
        If it is no number.
    """
    return float(text) * DEGREE


@texts.giving("a rate, zero or more, such as 3deg/h")
def turn_rate(text: str) -> float:
    """``3deg/h`` or ``1e-6rad/s`` in rad/s; a number alone is in deg/h.

    Raises
    ------
    ValueError
        If it is no rate, zero or above.
    """
    stripped = texts.numbered(text.strip())
    value, unit = (float(stripped), "deg/h") if texts.is_bare(stripped) else split_factor(stripped)
    return value * RATE_UNITS[unit]


@texts.giving("a size above zero such as 4GiB or 800MB")
def memory_size(text: str) -> int:
    """``4GiB``, ``800MB`` or a number of bytes, in bytes.

    Raises
    ------
    ValueError
        If it is none above zero.

    Examples
    --------
    >>> memory_size("0.5GiB")
    536870912
    """
    stripped = text.strip()
    number = stripped.rstrip("BGMKTibgmkt ")
    size = int(float(number) * _BYTES[stripped[len(number) :].strip().lower()])
    if size <= 0:
        raise ValueError
    return size


@texts.giving("a path")
def path(text: str) -> Path:
    """A path; an empty one would be the folder where one is.

    Raises
    ------
    ValueError
        If it is empty.
    """
    if not text:
        raise ValueError
    return Path(text)


def one_argument(convert: Callable[[str], texts.Value], metavar: str, **more: Any) -> Parameter:
    """A parameter of one argument that `convert` makes a value of."""

    def converted(_hint: object, tokens: Sequence[Token]) -> texts.Value:
        if len(tokens) > 1:
            raise ValueError(f"{tokens[0].keyword} is given more than once")
        return convert(tokens[0].value)

    # Without `accepts_keys` the parser would offer keys such as --kind.x.
    return Parameter(converter=converted, n_tokens=1, accepts_keys=False, metavar=metavar, **more)


def _each(_hint: object, tokens: Sequence[Token]) -> tuple[str, ...]:
    """Names, given at once or again and again."""
    return tuple(name for token in tokens for name in texts.names(token.value))


# ---- what the commands take ----------------------------------------------------------

Files = Annotated[list[Path], Parameter(name="FILE", help="Recordings.")]
File = Annotated[Path, Parameter(name="FILE", help="A recording.")]
_to = partial(one_argument, path, name=["-o", "--output"], group=OUTPUT)
Folder = Annotated[Path | None, _to(metavar="DIR", help="Folder.")]
NeededFolder = Annotated[Path, _to(metavar="DIR")]
NeededFile = Annotated[Path, _to(metavar="FILE")]
_PROCESSES: Final = "Processes; one for each core unless stated."
Workers = Annotated[int | None, one_argument(texts.whole_number, "N", help=_PROCESSES)]
_OVERWRITES: Final = "Write over files that are read, or that no such run made."
Force = Annotated[bool, Parameter(group=OUTPUT, help=_OVERWRITES)]
Debug = Annotated[bool, Parameter(group=OUTPUT, help="Traceback on errors.")]
Json = Annotated[bool, Parameter(group=OUTPUT, name="--json")]
_Names = tuple[str, ...] | None
_names = Parameter(converter=_each, n_tokens=1, group=ANALYSIS, metavar="NAME,…")
SeveralNames = Annotated[_Names, _names]
_Method = Literal["fos", "fos-paper", "fos-korenberg", "fris", "none"]
_OneOrByName = str | Mapping[str, str] | None
_of_file = partial(one_argument, group=READING)
of_analysis = partial(one_argument, group=ANALYSIS)
_Text = Annotated[str | None, Parameter(group=OUTPUT, metavar="TEXT")]


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Statements about a file from outside.

    Attributes
    ----------
    gyros
        Gyros: one, a pair to difference, a triad.
    kind
        What a gyro sample is: angle, increment or rate; x=rate,z=angle one by one.
    unit
        Unit of the gyros: arcsec, deg, rad, deg/s, deg/h, rad/s, counts.
    scale
        Size of one count.
    rate
        Samples per second.
    time
        Time stamps; none for no stamps.
    table
        Encoder of a turning table; none for no table.
    columns
        Columns that hold the gyros.
    slice
        Span to take, s from the start.
    counter_bits
        Width of counters that roll over.
    counter_period
        Counts after which a counter starts over, if that is no power of two.
    null_pulse
        Column that is not 0 at the null pulse; none for no null pulse.
    accelerometers
        Accelerometers, each by itself (--unit accelerometers=g); none for none.
    layout
        Records of a binary file: a preset (imu7-deg, imu7-rad) or a TOML of its fields.
    memory
        Most memory that the sizes a file declares may ask for: 4GiB unless stated; of a campaign,
        what all workers may take together: what is free unless stated.
    """

    gyros: Annotated[_Names, _of_file(texts.names, "x,z")] = None
    kind: Annotated[_OneOrByName, _of_file(texts.one_or_by_name, "KIND")] = None
    unit: Annotated[_OneOrByName, _of_file(texts.one_or_by_name, "UNIT")] = None
    scale: Annotated[str | None, Parameter(group=READING, metavar="0.1arcsec")] = None
    rate: Annotated[float | None, Parameter(group=READING, metavar="HZ")] = None
    time: Annotated[str | None, Parameter(group=READING, metavar="COLUMN[:UNIT]")] = None
    table: Annotated[str | None, Parameter(group=READING, metavar="COLUMN[:UNIT]")] = None
    columns: Annotated[Mapping[str, str] | None, _of_file(texts.by_name, "x=NAME,z=NAME")] = None
    slice: Annotated[texts.Span | None, _of_file(texts.span, "START:STOP")] = None
    counter_bits: Annotated[int | None, _of_file(texts.whole_number, "BITS")] = None
    counter_period: Annotated[float | None, Parameter(group=READING, metavar="COUNTS")] = None
    null_pulse: Annotated[str | None, Parameter(group=READING, metavar="COLUMN")] = None
    accelerometers: Annotated[_Names, _of_file(texts.names, "ax,ay,az")] = None
    layout: Annotated[str | None, Parameter(group=READING, metavar="NAME|TOML")] = None
    memory: Annotated[int | None, _of_file(memory_size, "4GiB")] = None
    debug: Debug = False


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class ReportOptions:
    """A report: where it goes, what stands on top, and how much of it is printed.

    Attributes
    ----------
    title
        Title of the report.
    device
        Unit under test.
    serial
        Its serial number.
    customer
        For whom it is measured.
    operator
        Who measured.
    date
        Of the measurement.
    heading
        TOML that states title, device, serial, customer, operator and date.
    pdf
        Write report.pdf, too.
    curve
        Show the curve, every fit, every unit and every note, too.
    """

    title: _Text = None
    device: _Text = None
    serial: _Text = None
    customer: _Text = None
    operator: _Text = None
    date: _Text = None
    heading: Annotated[Path | None, Parameter(group=OUTPUT, metavar="FILE")] = None
    pdf: Annotated[bool, Parameter(group=OUTPUT)] = False
    curve: Annotated[bool, Parameter(group=OUTPUT)] = False
    output: Folder = None
    force: Force = False

    @property
    def stated(self) -> list[str]:
        """Names of the options given that say what stands in a report."""
        names = [one.name for one in fields(self) if one.name not in ("curve", "output", "force")]
        return [name for name in names if getattr(self, name)]

    @property
    def title_block(self) -> "TitleBlock":
        """Top of the report; what is typed overrides the file.

        Raises
        ------
        ValueError
            If the file is none.
        OSError
            If it cannot be read.
        """
        from sagnac.report.sections import TitleBlock, require_pdf

        if self.pdf:
            require_pdf()
        of_file = TitleBlock() if self.heading is None else TitleBlock.from_toml(self.heading)
        typed = {field.name: getattr(self, field.name) for field in fields(TitleBlock)}
        return replace(of_file, **{name: text for name, text in typed.items() if text is not None})


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Options(Reading):
    """The options that all commands share which look into a recording.

    What its settings file states stands where nothing was typed.

    Attributes
    ----------
    method
        How periodic parts are removed: fos unless stated.
    step_4
        How the paper's methods fit the curve: plain (unless stated), relative or two-terms squares;
        plain-restored, relative-restored and two-terms-restored put the noise that went with the
        lines back.
    interval
        Between the angles of the curve: every sample unless stated, 1s on a table.
    confidence
        Of every interval: 0.95 unless stated; with --risk what that asks for.
    strict
        Refuse data in which a fault is found, be it one that the answer survives.
    covariates
        Drift at rest with a column of that name (or --columns temperature=NAME) is fitted beside
        the noise, and taken off.
    accept
        Faults to take knowingly, by name, such as clipping; the report says so.
    spec
        Limit to keep, such as 3e-4deg/sqrt(h) (N) or N=3e-4,B=0.01deg/h, or a TOML; a command
        that gives a verdict exits with 3 if a gyro fails, 4 if it is undecided.
    risk
        Largest probability of passing a gyro that lies at its limit.
    settings
        Settings of an earlier run (its settings.toml, if options were typed); options that are
        typed now override them.
    as_json
        JSON on standard output, nothing else there.

    Raises
    ------
    UsageError
        If the settings file is no TOML, or has a key that is no option.
    OSError
        If it cannot be read.
    """

    method: Annotated[_Method | None, Parameter(group=ANALYSIS)] = None
    step_4: Annotated[str | None, Parameter(group=ANALYSIS, metavar="NAME")] = None
    interval: Annotated[float | None, of_analysis(texts.seconds, "1s")] = None
    confidence: Annotated[float | None, Parameter(group=ANALYSIS, metavar="0.95")] = None
    strict: Annotated[bool, Parameter(group=ANALYSIS)] = False
    covariates: Annotated[_Names, of_analysis(texts.names, "temperature")] = None
    accept: SeveralNames = None
    spec: Annotated[str | None, Parameter(group=ANALYSIS, metavar="VALUE[UNIT]")] = None
    risk: Annotated[float | None, Parameter(group=ANALYSIS, metavar="0.05")] = None
    settings: Annotated[Path | None, Parameter(group=ANALYSIS, metavar="FILE")] = None
    as_json: Json = False

    def __post_init__(self) -> None:
        if self.settings is None:
            return
        from sagnac.core.documents import ANY, read_toml, table

        try:
            stated = read_toml(self.settings, table(dict.fromkeys(_REPEATED, ANY)))
        except ValueError as error:
            raise UsageError(f"--settings {self.settings}: {error}") from None
        for name, value in stated.items():
            if getattr(self, name) == _DEFAULTS[name]:
                object.__setattr__(self, name, _stated_value(name, value))

    @property
    def as_toml(self) -> str:
        """TOML of the options that were typed, without those that belong to one run alone."""
        stated = {name: getattr(self, name) for name in _REPEATED}
        typed = {name: value for name, value in stated.items() if value != _DEFAULTS[name]}
        if "slice" in typed:
            typed["slice"] = texts.text_of(typed["slice"])
        return texts.toml_table(typed)


_DEFAULTS: Final = {field.name: field.default for field in fields(Options)}
# What a settings file holds: all but what belongs to one run alone.
_OF_ONE_RUN: Final = ("debug", "as_json", "settings", "memory")
_REPEATED: Final = tuple(name for name in _DEFAULTS if name not in _OF_ONE_RUN)
NO_STATEMENT: Final = Reading()
NO_OPTIONS: Final = Options()
NO_REPORT: Final = ReportOptions()


def _stated_value(name: str, value: Any) -> Any:
    """The value of an option that a settings file states, as text or as TOML has it."""
    if isinstance(value, str):
        try:
            return texts.value_of(name, value)
        except ValueError as error:
            raise UsageError(f"--settings: {error}") from None
    return tuple(value) if isinstance(value, list) else value


# ---- what the library takes ----------------------------------------------------------


def statement_of(options: Reading) -> "sagnac.Statement":
    """Statement that the options make about the file.

    Raises
    ------
    ValueError
        If a value cannot be.
    """
    columns = dict(options.columns or {})
    for name in getattr(options, "covariates", None) or ():
        columns.setdefault(name, name)
    return sagnac.Statement(**_fields_of(sagnac.Statement, options) | {"columns": columns})


def _fields_of(kind: type, options: Reading) -> dict[str, Any]:
    """What options state of each field of a statement or of settings, by its name."""
    names = [field.name for field in fields(kind)]
    return {name: getattr(options, texts.OPTION_OF.get(name, name), None) for name in names}


def settings_of(options: Options, **defaults: Any) -> "Settings":
    """Settings that were typed, over those of the command itself; raises as `settings_typed`."""
    return sagnac.Settings(**{**defaults, **settings_typed(options)})


def settings_typed(options: Options) -> dict[str, Any]:
    """Settings that were typed, by name.

    Raises
    ------
    ValueError
        If a value cannot be.
    UsageError
        If a risk is stated and no limit.
    """
    from sagnac.verdict.limits import specification_of

    risk, confidence = options.risk, options.confidence
    if risk is not None and options.spec is None:
        raise UsageError("--risk is of a limit; give --spec, too")
    limits = None if options.spec is None else specification_of(options.spec, risk=risk)
    if confidence is None and limits is not None and limits.risk is not None:
        # A bound may be wrong by all that the confidence lacks.
        confidence = 1.0 - limits.risk
    typed = _fields_of(sagnac.Settings, options)
    typed |= {"confidence": confidence, "specification": limits}
    return {name: value for name, value in typed.items() if value is not None}


def inputs(files: Iterable[Path], options: Reading, *more: Path | None) -> list[Path]:
    """Files that a run reads: recordings, the TOML beside each, and what its options name."""
    from sagnac.formats.statement import beside_paths

    stated = [getattr(options, name, None) for name in ("settings", "spec", "layout")]
    named = [Path(one) for one in (*stated, *more) if one is not None]
    beside = (place for file in files for place in (file, *beside_paths(file)))
    return [*beside, *named]


# ---- a recording that a command reads ------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadFile:
    """A recording that was read.

    Attributes
    ----------
    recording
        What the file holds.
    seconds
        Time that reading took, s by stage.
    progress
        Called with the stage of what is done with it, and the fraction done.
    """

    recording: "sagnac.Recording"
    seconds: dict[str, float]
    progress: Progress

    def analyzed(self, settings: "Settings", progress: Progress | None = None) -> "Analysis":
        """The analysis, with the time of reading."""
        analysis = sagnac.analyze(self.recording, settings, progress=progress or self.progress)
        return analysis.with_seconds(self.seconds)


@contextmanager
def reading(
    file: Path, options: Reading, *, verify: bool = True, prefix: str = ""
) -> Iterator[ReadFile]:
    """A recording; inside, progress is shown, and an error in the data names the file.

    What a fit or a factorization cannot do with numbers is a fault of the data, too; the error says
    which numbers they are.

    Parameters
    ----------
    file
        Path of it.
    options
        What is stated of it, and how much memory it may take.
    verify
        Refuse data that are not sound.
    prefix
        Goes before each stage of progress.

    Raises
    ------
    RecordingError
        If the file cannot be read or is not sound, or what is done inside fails on its numbers.
    """
    from sagnac.formats.files import USUAL, limited

    statement, began = statement_of(options), time.perf_counter()
    with progress_shown(prefix) as progress:
        progress("read", 0.0)
        with limited(options.memory or USUAL):
            recording = sagnac.read(file, statement, verify=verify)
        progress("read", 1.0)
        seconds = {"read": time.perf_counter() - began}
        try:
            yield ReadFile(recording=recording, seconds=seconds, progress=progress)
        except (sagnac.RecordingError, sagnac.MissingExtra) as error:
            raise error.at(str(file)) from error
        except (ValueError, ArithmeticError) as error:
            # numpy's LinAlgError is a ValueError.
            problem = f"the analysis fails ({error}) on {_numbers(recording)}"
            remedy = "look at the data with sagnac check"
            raise sagnac.RecordingError(problem, path=str(file), remedy=remedy) from error


def _numbers(recording: "sagnac.Recording") -> str:
    """The samples of each channel in one line: how many, and between which values they lie."""
    numbers = []
    for channel in (*recording.gyros, *recording.accelerometers):
        unit, values = channel.plain_unit, channel.values
        ends = f"{values.min() / unit.size:.4g} to {values.max() / unit.size:.4g}"
        numbers.append(f"{channel.name}: {values.size} samples from {ends} {unit.name}")
    return ", ".join(numbers)
