"""The options that several commands share, and what each of them is turned into."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeVar, get_args

from cyclopts import Group, Parameter, Token

from sagnac.cli.errors import UsageError
from sagnac.units import unit_of

if TYPE_CHECKING:
    from sagnac.analysis.settings import Method, Settings
    from sagnac.formats import Statement
    from sagnac.stability.names import Estimator

Value = TypeVar("Value")
Span = tuple[float | None, float | None]

READING: Final = Group("What the file does not say", sort_key=1)
ANALYSIS: Final = Group("Analysis", sort_key=2)
OUTPUT: Final = Group("Output", sort_key=3)

# What `Statement` calls otherwise than the command line does.
_OPTION_OF: Final = {"sample_rate": "rate", "span": "slice"}


# ---- from what was typed: one argument -> one value ----------------------------------


def names(text: str) -> tuple[str, ...]:
    """``x,z`` as names.

    Raises
    ------
    ValueError
        If a name is empty.
    """
    found = tuple(name.strip() for name in text.split(","))
    if "" in found:
        raise ValueError(f"{text!r}; give names with commas between them, such as x,z")
    return found


def by_name(text: str) -> dict[str, str]:
    """``x=A,z=B`` as a mapping.

    Raises
    ------
    ValueError
        If a name or a value is missing.
    """
    pairs = [item.partition("=") for item in text.split(",")]
    if any(not name.strip() or not value.strip() for name, _, value in pairs):
        raise ValueError(f"{text!r}; give NAME=VALUE with commas between, such as x=A,z=B")
    return {name.strip(): value.strip() for name, _, value in pairs}


def one_or_by_name(text: str) -> str | dict[str, str]:
    """``rate`` for all gyros, or ``x=rate,z=angle`` one by one."""
    return by_name(text) if "=" in text else text


def span(text: str) -> Span:
    """``START:STOP`` in s; either may be left out.

    Raises
    ------
    ValueError
        If it is none.
    """
    start, colon, stop = text.partition(":")
    try:
        if not colon:
            raise ValueError
        return (float(start) if start.strip() else None, float(stop) if stop.strip() else None)
    except ValueError:
        raise ValueError(f"{text!r}; give START:STOP in s, such as 630:930") from None


def seconds(text: str) -> float:
    """``1``, ``1s``, ``100ms`` or ``2h`` in s.

    Raises
    ------
    ValueError
        If it is no time above zero.
    """
    stripped = text.strip()
    try:
        bare = stripped.replace(".", "", 1).isdigit()
        value = float(stripped) if bare else unit_of(_numbered(stripped), "time").size
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise ValueError(f"{text!r}; give a time above zero such as 1s, 100ms or 2h")
    return value


def _numbered(text: str) -> str:
    """A unit with a number before it; ``s`` alone would be one second."""
    if not text[:1].isdigit() and not text.startswith("."):
        raise ValueError(text)
    return text


def _typed(convert: Callable[[str], Value], **more: Any) -> Parameter:
    """A parameter of one argument that `convert` makes a value of."""

    def converted(_hint: object, tokens: Sequence[Token]) -> Value:
        if len(tokens) > 1:
            raise ValueError(f"{tokens[0].keyword} is given more than once")
        return convert(tokens[0].value)

    # Without these the parser would offer --empty-gyros, and keys such as --kind.x.
    return Parameter(converter=converted, n_tokens=1, accepts_keys=False, negative="", **more)


def _each(_hint: object, tokens: Sequence[Token]) -> tuple[str, ...]:
    """Names, given at once or again and again."""
    return tuple(name for token in tokens for name in names(token.value))


# ---- what the commands take ----------------------------------------------------------


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What is stated of a file from outside."""

    gyros: Annotated[
        tuple[str, ...] | None,
        _typed(
            names, group=READING, metavar="x,z", help="Gyros: one, a pair to difference, a triad."
        ),
    ] = None
    kind: Annotated[
        str | Mapping[str, str] | None,
        _typed(
            one_or_by_name,
            group=READING,
            metavar="KIND",
            help="What a gyro sample is: angle, increment or rate; x=rate,z=angle one by one.",
        ),
    ] = None
    unit: Annotated[
        str | Mapping[str, str] | None,
        _typed(
            one_or_by_name,
            group=READING,
            metavar="UNIT",
            help="Unit of the gyros: arcsec, deg, rad, deg/s, deg/h, rad/s, counts.",
        ),
    ] = None
    scale: Annotated[
        str | None, Parameter(group=READING, metavar="0.1arcsec", help="Size of one count.")
    ] = None
    rate: Annotated[
        float | None, Parameter(group=READING, metavar="HZ", help="Samples per second.")
    ] = None
    time: Annotated[
        str | None,
        Parameter(group=READING, metavar="COLUMN[:UNIT]", help="Time stamps; none for no stamps."),
    ] = None
    table: Annotated[
        str | None,
        Parameter(group=READING, metavar="COLUMN[:UNIT]", help="Its encoder; none for no table."),
    ] = None
    columns: Annotated[
        Mapping[str, str] | None,
        _typed(
            by_name, group=READING, metavar="x=NAME,z=NAME", help="Columns that hold the gyros."
        ),
    ] = None
    slice: Annotated[
        Span | None,
        _typed(span, group=READING, metavar="START:STOP", help="Span to take, s from the start."),
    ] = None
    counter_bits: Annotated[
        int | None,
        Parameter(group=READING, metavar="BITS", help="Width of counters that roll over."),
    ] = None
    null_pulse: Annotated[
        str | None,
        Parameter(group=READING, metavar="COLUMN", help="Column that is not 0 at the null pulse."),
    ] = None
    debug: Annotated[
        bool,
        Parameter(group=OUTPUT, negative="", show_default=False, help="Traceback on errors."),
    ] = False


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Options(Reading):
    """The options that all commands share which look into a recording."""

    method: Annotated[
        Literal["fos", "fos-paper", "fos-korenberg", "fris", "none"] | None,
        Parameter(group=ANALYSIS, help="How periodic parts are removed: fos unless stated."),
    ] = None
    interval: Annotated[
        float | None,
        _typed(
            seconds,
            group=ANALYSIS,
            metavar="1s",
            help="Between the angles of the curve: 1s unless stated; every sample in avar.",
        ),
    ] = None
    confidence: Annotated[
        float, Parameter(group=ANALYSIS, metavar="0.95", help="Of every interval.")
    ] = 0.95
    as_json: Annotated[
        bool,
        Parameter(
            name="--json",
            group=OUTPUT,
            negative="",
            show_default=False,
            help="The analysis on standard output, nothing else there.",
        ),
    ] = False


NO_STATEMENT: Final = Reading()
NO_OPTIONS: Final = Options()

Files = Annotated[list[Path], Parameter(name="FILE", help="Recordings.")]
File = Annotated[Path, Parameter(name="FILE", help="A recording.")]
Folder = Annotated[
    Path | None, Parameter(name=["-o", "--output"], group=OUTPUT, metavar="DIR", help="Folder.")
]
Debug = Annotated[
    bool, Parameter(group=OUTPUT, negative="", show_default=False, help="Traceback on errors.")
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
Duration = Annotated[
    float | None,
    _typed(seconds, metavar="2h", help="Length of the recording; s unless stated."),
]


# ---- what the library takes ----------------------------------------------------------


def statement_of(options: Reading) -> "Statement":
    """What the options state of the file.

    Raises
    ------
    UsageError
        If a value cannot be.
    """
    from sagnac.formats import Statement

    try:
        return Statement(
            gyros=options.gyros,
            kind=options.kind,
            unit=options.unit,
            scale=options.scale,
            sample_rate=options.rate,
            time=options.time,
            table=options.table,
            columns=options.columns or {},
            span=options.slice,
            counter_bits=options.counter_bits,
            null_pulse=options.null_pulse,
        )
    except ValueError as error:
        raise UsageError(_of_option(error)) from error


def settings_of(
    options: Options,
    *,
    method: "Method" = "fos",
    interval: float | None = 1.0,
    estimators: "tuple[Estimator, ...]" = (),
) -> "Settings":
    """What the options choose, with a command's own defaults for what was not typed.

    Raises
    ------
    UsageError
        If a value cannot be.
    """
    from sagnac.analysis.settings import Settings

    try:
        return Settings(
            gyros=options.gyros or (),
            method=options.method or method,
            interval=interval if options.interval is None else options.interval,
            confidence=options.confidence,
            estimators=estimators,
        )
    except ValueError as error:
        raise UsageError(_of_option(error)) from error


def estimators_of(stated: Sequence[str] | None) -> "tuple[Estimator, ...]":
    """The curves asked for, in the order of the family.

    Raises
    ------
    UsageError
        If one is not known.
    """
    from sagnac.stability.names import Estimator

    known = get_args(Estimator)
    wanted = stated or ("oadev",)
    for name in wanted:
        if name not in known:
            raise UsageError(f"--estimator {name}: is not known; use {', '.join(known)}")
    return tuple(name for name in known if name in wanted)


def _of_option(error: ValueError) -> str:
    """What an error says of an argument of the library, said of the option that gave it."""
    argument, space, said = str(error).partition(" ")
    option = _OPTION_OF.get(argument, argument)
    if option not in {field.name for field in fields(Options)}:
        return str(error)
    return f"--{option.replace('_', '-')}{space}{said}"
