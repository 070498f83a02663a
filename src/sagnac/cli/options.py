"""The options that several commands share, what each is turned into, and a TOML of them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from cyclopts import Group, Parameter, Token

import sagnac
from sagnac.cli.output import UsageError
from sagnac.core import texts
from sagnac.core.units import RATE_UNITS, split_factor, unit_of

if TYPE_CHECKING:
    from sagnac.analysis.settings import CurveNames, Method
    from sagnac.report.sections import TitleBlock

READING: Final = Group("What the file does not say", sort_key=1)
ANALYSIS: Final = Group("Analysis", sort_key=2)
OUTPUT: Final = Group("Output", sort_key=3)

# Bytes in a unit of memory.
_BYTES: Final = {
    "": 1.0,
    "b": 1.0,
    **{f"{prefix}b": 1000.0**power for power, prefix in enumerate("kmgt", start=1)},
    **{f"{prefix}ib": 1024.0**power for power, prefix in enumerate("kmgt", start=1)},
}


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


def several_seconds(text: str) -> tuple[float, ...]:
    """``60s,10min`` in s.

    Raises
    ------
    ValueError
        If one of them is no time above zero.
    """
    return tuple(texts.seconds(part) for part in text.split(","))


@texts.giving("an angle above zero such as 2deg or 30arcmin")
def angle(text: str) -> float:
    """``2deg`` or ``30arcmin`` in rad.

    Raises
    ------
    ValueError
        If it is no angle above zero with its unit.
    """
    return unit_of(texts.numbered(text.strip()), "angle").size


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
    size = _BYTES[stripped[len(number) :].strip().lower()]
    found = int(float(number) * size)
    if found <= 0:
        raise ValueError
    return found


def one_argument(convert: Callable[[str], texts.Value], **more: Any) -> Parameter:
    """A parameter of one argument that `convert` makes a value of."""

    def converted(_hint: object, tokens: Sequence[Token]) -> texts.Value:
        if len(tokens) > 1:
            raise ValueError(f"{tokens[0].keyword} is given more than once")
        return convert(tokens[0].value)

    # Without these the parser would offer --empty-gyros, and keys such as --kind.x.
    return Parameter(converter=converted, n_tokens=1, accepts_keys=False, negative="", **more)


def _each(_hint: object, tokens: Sequence[Token]) -> tuple[str, ...]:
    """Names, given at once or again and again."""
    return tuple(name for token in tokens for name in texts.names(token.value))


# ---- what the commands take ----------------------------------------------------------


def _flag(**more: Any) -> Parameter:
    """A switch that is off unless it is typed."""
    return Parameter(group=OUTPUT, negative="", show_default=False, **more)


Debug = Annotated[bool, _flag(help="Traceback on errors.")]
Json = Annotated[bool, _flag(name="--json")]
_Names = tuple[str, ...] | None
_OneOrByName = str | Mapping[str, str] | None
_Text = Annotated[str | None, Parameter(group=OUTPUT, metavar="TEXT")]


def _read(convert: Callable[[str], Any], metavar: str) -> Parameter:
    """What a file does not say, in one argument."""
    return one_argument(convert, group=READING, metavar=metavar)


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
        Its encoder; none for no table.
    columns
        Columns that hold the gyros.
    slice
        Span to take, s from the start.
    counter_bits
        Width of counters that roll over.
    counter_period
        Where counters start over that are of no bits.
    null_pulse
        Column that is not 0 at the null pulse.
    accelerometers
        Accelerometers, each by itself (--unit accelerometers=g); none for none.
    layout
        Records of a binary file: a preset (imu7-deg, imu7-rad) or a TOML of its fields.
    memory
        Most memory that what a file declares may take: 4GiB unless stated.
    """

    gyros: Annotated[_Names, _read(texts.names, "x,z")] = None
    kind: Annotated[_OneOrByName, _read(texts.one_or_by_name, "KIND")] = None
    unit: Annotated[_OneOrByName, _read(texts.one_or_by_name, "UNIT")] = None
    scale: Annotated[str | None, Parameter(group=READING, metavar="0.1arcsec")] = None
    rate: Annotated[float | None, Parameter(group=READING, metavar="HZ")] = None
    time: Annotated[str | None, Parameter(group=READING, metavar="COLUMN[:UNIT]")] = None
    table: Annotated[str | None, Parameter(group=READING, metavar="COLUMN[:UNIT]")] = None
    columns: Annotated[Mapping[str, str] | None, _read(texts.by_name, "x=NAME,z=NAME")] = None
    slice: Annotated[texts.Span | None, _read(texts.span, "START:STOP")] = None
    counter_bits: Annotated[int | None, Parameter(group=READING, metavar="BITS")] = None
    counter_period: Annotated[float | None, Parameter(group=READING, metavar="COUNTS")] = None
    null_pulse: Annotated[str | None, Parameter(group=READING, metavar="COLUMN")] = None
    accelerometers: Annotated[_Names, _read(texts.names, "ax,ay,az")] = None
    layout: Annotated[str | None, Parameter(group=READING, metavar="NAME|TOML")] = None
    memory: Annotated[int | None, _read(memory_size, "4GiB")] = None
    debug: Debug = False


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Heading:
    """Top of a report.

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
    """

    title: _Text = None
    device: _Text = None
    serial: _Text = None
    customer: _Text = None
    operator: _Text = None
    date: _Text = None
    heading: Annotated[Path | None, Parameter(group=OUTPUT, metavar="FILE")] = None
    pdf: Annotated[bool, _flag()] = False


NO_HEADING: Final = Heading()


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Options(Reading):
    """The options that all commands share which look into a recording.

    Attributes
    ----------
    method
        How periodic parts are removed: fos unless stated.
    interval
        Between the angles of the curve: every sample unless stated, 1s on a table.
    confidence
        Of every interval: 0.95 unless stated; with --risk what that asks for.
    strict
        Refuse data in which a fault is found, be it one that the answer survives.
    accept
        Faults to take knowingly, by name, such as clipping; the report says so.
    risk
        Largest probability of passing a gyro that lies at its limit.
    settings
        Settings of an earlier run (its settings.toml); what is typed goes before.
    as_json
        The analysis on standard output, nothing else there.
    """

    method: Annotated[
        Literal["fos", "fos-paper", "fos-korenberg", "fris", "none"] | None,
        Parameter(group=ANALYSIS),
    ] = None
    step_4: Annotated[
        Literal[
            "plain",
            "plain-restored",
            "relative",
            "relative-restored",
            "two-terms",
            "two-terms-restored",
        ]
        | None,
        Parameter(
            group=ANALYSIS,
            help="How the paper's methods fit the curve: plain unless stated; -restored puts the "
            "noise that went with the lines back.",
        ),
    ] = None
    interval: Annotated[float | None, one_argument(texts.seconds, group=ANALYSIS, metavar="1s")] = (
        None
    )
    confidence: Annotated[float | None, Parameter(group=ANALYSIS, metavar="0.95")] = None
    strict: Annotated[bool, Parameter(group=ANALYSIS, negative="", show_default=False)] = False
    covariates: Annotated[
        tuple[Literal["temperature"], ...] | None,
        one_argument(
            texts.names,
            group=ANALYSIS,
            metavar="temperature",
            help="Drift at rest with a column of that name (or --columns temperature=NAME) is "
            "fitted beside the noise, and taken off.",
        ),
    ] = None
    accept: Annotated[
        tuple[str, ...] | None,
        Parameter(converter=_each, n_tokens=1, group=ANALYSIS, metavar="NAME,…", negative=""),
    ] = None
    spec: Annotated[
        str | None,
        Parameter(
            group=ANALYSIS,
            metavar="VALUE[UNIT]",
            help="Limit to keep, such as 3e-4deg/sqrt(h) (N) or N=3e-4,B=0.01deg/h, or a TOML; "
            "exit status 3 if a gyro fails, 4 if it is undecided.",
        ),
    ] = None
    risk: Annotated[float | None, Parameter(group=ANALYSIS, metavar="0.05")] = None
    settings: Annotated[Path | None, Parameter(group=ANALYSIS, metavar="FILE")] = None
    as_json: Json = False


NO_STATEMENT: Final = Reading()
NO_OPTIONS: Final = Options()

Files = Annotated[list[Path], Parameter(name="FILE", help="Recordings.")]
File = Annotated[Path, Parameter(name="FILE", help="A recording.")]
Folder = Annotated[
    Path | None, Parameter(name=["-o", "--output"], group=OUTPUT, metavar="DIR", help="Folder.")
]
Workers = Annotated[
    int | None, Parameter(metavar="N", help="Processes; one for each core unless stated.")
]
Estimators = Annotated[
    tuple[str, ...] | None,
    Parameter(
        converter=_each,
        n_tokens=1,
        group=ANALYSIS,
        metavar="NAME,…",
        negative="",
        help="Curves: oadev (unless stated), adev, mdev, tdev, hdev, ohdev, totdev, mtotdev, "
        "theo1, theoh, haar; several with commas between, or given again.",
    ),
]
Force = Annotated[bool, _flag(help="Write over files that are read, or that no such run made.")]
Curve = Annotated[bool, _flag(help="Show the curve, every fit, every unit and every note, too.")]
Duration = Annotated[
    float | None,
    one_argument(texts.seconds, metavar="2h", help="Length of the recording; s unless stated."),
]


# ---- what the library takes ----------------------------------------------------------


def statement_of(options: Reading) -> "sagnac.Statement":
    """Statement that the options make about the file.

    Raises
    ------
    UsageError
        If a value cannot be.
    """
    columns = dict(options.columns or {})
    for name in getattr(options, "covariates", None) or ():
        columns.setdefault(name, name)
    try:
        stated = {
            field.name: getattr(options, texts.OPTION_OF.get(field.name, field.name))
            for field in fields(sagnac.Statement)
        }
        return sagnac.Statement(**{**stated, "columns": columns})
    except ValueError as error:
        raise UsageError(_of_option(error)) from error


def settings_of(
    options: Options,
    *,
    method: "Method" = "fos",
    estimators: "CurveNames" = (),
) -> "sagnac.Settings":
    """Settings that the options choose, with a command's own defaults for what was not typed.

    Raises
    ------
    UsageError
        If a value cannot be.
    """
    from sagnac.noise.readings import READINGS

    try:
        specification = specification_stated(options)
        return sagnac.Settings(
            gyros=options.gyros or (),
            method=options.method or method,
            interval=options.interval,
            confidence=_confidence(options, specification),
            estimators=estimators,
            strict=options.strict,
            accepted=options.accept or (),
            covariates=options.covariates or (),
            specification=specification,
            step_4=READINGS[options.step_4 or "plain"],
        )
    except ValueError as error:
        raise UsageError(_of_option(error)) from error


def title_block_of(heading: Heading) -> "TitleBlock":
    """Top of a report by the options; what is typed goes before the file.

    Raises
    ------
    ValueError
        If the file is none.
    OSError
        If it cannot be read.
    """
    from sagnac.report.sections import TitleBlock, require_pdf

    if heading.pdf:
        require_pdf()
    of_file = TitleBlock() if heading.heading is None else TitleBlock.from_toml(heading.heading)
    typed = {field.name: getattr(heading, field.name) for field in fields(TitleBlock)}
    return replace(of_file, **{name: text for name, text in typed.items() if text is not None})


def specification_stated(options: Options) -> "sagnac.Specification | None":
    """The limits that the options state, if any.

    Raises
    ------
    UsageError
        If a risk is stated and no limit.
    ValueError
        If they make no sense.
    """
    from sagnac.verdict.limits import specification_of

    if options.spec is None:
        if options.risk is not None:
            raise UsageError("--risk is of a limit; give --spec, too")
        return None
    return specification_of(options.spec, risk=options.risk)


def _confidence(options: Options, specification: "sagnac.Specification | None") -> float:
    """The confidence typed, else what the risk asks for: a bound may be wrong by all it lacks."""
    if options.confidence is not None:
        return options.confidence
    if specification is None or specification.risk is None:
        return 0.95
    return 1.0 - specification.risk


def estimators_of(stated: Sequence[str] | None) -> "CurveNames":
    """The curves asked for, in the order of the family.

    Raises
    ------
    UsageError
        If one is not known.
    """
    from sagnac.analysis.settings import ESTIMATORS

    wanted = stated or ("oadev",)
    for name in wanted:
        if name not in ESTIMATORS:
            raise UsageError(f"--estimator {name}: is not known; use {', '.join(ESTIMATORS)}")
    return tuple(name for name in ESTIMATORS if name in wanted)


def _of_option(error: ValueError) -> str:
    """An error in an argument of the library, worded for the option that gave it."""
    argument, space, said = str(error).partition(" ")
    option = texts.OPTION_OF.get(argument, argument)
    if option not in {field.name for field in fields(Options)}:
        return str(error)
    return f"--{option.replace('_', '-')}{space}{said}"


# ---- settings file -----------------------------------------------------------------

# What belongs to one run alone.
_LEFT_OUT: Final = ("debug", "as_json", "settings", "memory")
_NAMES: Final = tuple(field.name for field in fields(Options) if field.name not in _LEFT_OUT)


def settings_text(options: Options) -> str:
    """Options that were typed, as TOML; empty if none was."""
    stated = {name: getattr(options, name) for name in _NAMES}
    typed = {name: value for name, value in stated.items() if value != getattr(NO_OPTIONS, name)}
    if typed.get("slice"):
        typed["slice"] = texts.text_of(typed["slice"])
    return texts.toml_table(typed)


def with_settings(options: Options) -> Options:
    """The options with those of their settings file where nothing was typed.

    Raises
    ------
    UsageError
        If the file is no TOML, or has a key that is no option.
    OSError
        If it cannot be read.
    """
    from sagnac.core.documents import ANY, read_toml, table

    path = options.settings
    if path is None:
        return options
    try:
        stated = read_toml(path, table(dict.fromkeys(_NAMES, ANY)))
    except ValueError as error:
        raise UsageError(f"--settings {path}: {error}") from None
    found = {
        name: _stated_value(name, value)
        for name, value in stated.items()
        if getattr(options, name) == getattr(NO_OPTIONS, name)
    }
    return replace(options, **found)


def _stated_value(name: str, value: Any) -> Any:
    if isinstance(value, str):
        try:
            return texts.value_of(name, value)
        except ValueError as error:
            raise UsageError(f"--settings: {error}") from None
    return tuple(value) if isinstance(value, list) else value


def inputs(files: Iterable[Path], options: Reading, *more: Path | None) -> list[Path]:
    """Files that a run reads: recordings, the TOML beside each, and what its options name."""
    stated = [getattr(options, name, None) for name in ("settings", "spec", "layout")]
    named = [Path(one) for one in (*stated, *more) if one is not None]
    beside = [
        place
        for file in files
        for place in (file, file.with_name(f"{file.name}.toml"), file.with_suffix(".toml"))
    ]
    return [*beside, *named]
