"""Statements that a file needs to be read, guessed from names, units and numbers."""

import re
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from functools import partial
from typing import Final

import numpy as np

from sagnac.core import arrays, units
from sagnac.core.errors import RecordingError
from sagnac.core.texts import text_of
from sagnac.formats import choice, suspicions
from sagnac.formats.choice import choose_one, is_like_table, is_like_time
from sagnac.formats.source import Column, Columns, Source, Values
from sagnac.formats.statement import Statements, is_counts, is_known
from sagnac.recording.columns import ACCELEROMETER_NAMES, GYRO_NAMES

# What stands for something that no file tells: to be replaced by whoever knows it.
KIND: Final = "KIND"
UNIT: Final = "UNIT"
# Option -> what is to be stated by it.
Inputs = dict[str, str]

_GYRO: Final = re.compile(r"gyr|kreisel|dreh|omega|ang(?:ular)?[_ ]?(?:vel|rate)|^w[_ ]?", re.I)
_OTHER: Final = re.compile(
    r"(?i)acc|beschl|mag|temp|orient|quat|cov|force|pos|vel(?!oc)|euler|(?:roll|pitch|yaw)(?!.*rate)"
    r"|(?:^|[^a-z])q(?:[^a-z]|[wxyz](?:$|[^a-z]))"
)
_FORCE: Final = re.compile(r"acc|beschl|force|kraft|^f[_ ]?[xyz]|^a[_ ]?[xyz]", re.I)
# An axis, and what may stand before it: of an accelerometer, and of a gyro.
_AXIS: Final = r"(?:^|[^a-z]|{before}){axis}(?:$|[^a-z])"
_BEFORE_FORCE: Final = r"acc|accel|acceleration|beschleunigung|force|kraft|^[af]"
_BEFORE_GYRO: Final = r"gyro?|(?:^|[^a-z])g|omega|w|kreisel|rate|cnts?|counts?"


def suggestion(source: Source, statements: Statements) -> Inputs:
    """Inputs to state besides what is stated: name -> value.

    Parameters
    ----------
    source
        The opened file.
    statements
        Of caller, TOML and file.

    Returns
    -------
    dict of str
        ``{"columns": "x=2,z=4", "kind": "rate", "unit": "UNIT"}``. A word in capitals stands for
        what cannot be guessed. Empty if nothing is missing.
    """
    missing: Inputs = {}
    gyros = _gyros(source, statements, missing)
    _kind_and_unit(gyros, statements, missing)
    _unit_of_forces(source.columns, statements, missing)
    taken = [column.key for column in gyros.values()]
    table = choose_one(source.columns, statements, "table", taken)
    if table is not None and not table.unit:
        missing["table"] = f"{table.name}:{UNIT}"
    sampling = _sampling(source, statements, taken)
    # A file that lacks nothing is not asked of its encoder.
    if table is None and statements.role("table") is None and (missing or sampling):
        alike = [one for one in source.columns if one.key not in taken and is_like_table(one)]
        if len(alike) == 1:
            unit = "" if alike[0].unit else f":{UNIT}"
            missing["table"] = f"{column_text(alike[0])}{unit}"
    return missing | sampling


def accelerometer_inputs(source: Source, statements: Statements) -> Inputs:
    """Inputs by which the accelerometers of a file that states none are read as well.

    Parameters
    ----------
    source, statements
        As for `suggestion`.

    Returns
    -------
    dict of str
        ``{"columns": "ax=acc_x", "accelerometers": "ax", "unit": "accelerometers=UNIT"}``: what
        goes beside what is stated of the gyros. Empty if there seem to be none, or accelerometers
        are stated already.
    """
    if any(one.accelerometers is not None for one in statements.in_order):
        return {}
    numbered = [one for one in source.columns if _may_be_force(one)]
    forces = {}
    for name, axis in zip(ACCELEROMETER_NAMES, "xyz", strict=True):
        pattern = re.compile(_AXIS.format(before=_BEFORE_FORCE, axis=axis), re.I)
        alike = [one for one in numbered if pattern.search(one.name)]
        alike += [one for one in source.columns if one.name == name and one not in alike]
        if len(alike) == 1:
            forces[name] = alike[0]
    if not forces and len(numbered) == len(ACCELEROMETER_NAMES):
        # Columns of one array, such as acc.1, acc.2 and acc.3.
        forces = dict(zip(ACCELEROMETER_NAMES, numbered, strict=True))
    if not forces:
        return {}
    renamed = {name: column_text(one) for name, one in forces.items() if one.key != name}
    unit = f"accelerometers={UNIT}" if any(one.unit is None for one in forces.values()) else ""
    inputs = {"accelerometers": ",".join(forces), "columns": text_of(renamed), "unit": unit}
    return {name: text for name, text in inputs.items() if text}


def _may_be_force(column: Column) -> bool:
    """By its unit if it has one, else by its name."""
    if column.unit is None:
        return _FORCE.search(column.name) is not None
    return units.sensor_of(column.unit) == "accelerometer"


def named(columns: Columns, gyro: str) -> Column | None:
    """The column that seems to be gyro ``x``, ``y`` or ``z`` by its name, None if several may be.

    Examples
    --------
    >>> columns = [Column(key=name, name=name, number=1) for name in ("acc_x", "gyro_x", "time")]
    >>> named(columns, "x").key
    'gyro_x'
    """
    axis = _AXIS.format(before=_BEFORE_GYRO, axis=gyro)
    candidates = [one for one in columns if re.search(axis, one.name, re.I) and _is_no_other(one)]
    if len(candidates) > 1:
        candidates = [one for one in candidates if _GYRO.search(one.name)] or candidates
    return candidates[0] if len(candidates) == 1 else None


def _may_be_gyro(column: Column) -> bool:
    unit = column.unit
    if unit is None or is_counts(unit) or not is_known(unit):
        return True
    return units.split_factor(unit)[1] in (*units.ANGLE_UNITS, *units.RATE_UNITS)


def _is_no_other(column: Column) -> bool:
    """Whether neither name nor unit says that a column is something else than a gyro."""
    is_other = is_like_time(column) or _OTHER.search(column.name) is not None
    return not is_other and _may_be_gyro(column)


def _gyros(source: Source, statements: Statements, missing: Inputs) -> dict[str, Column]:
    columns = source.columns
    with suppress(RecordingError):
        return choice.choose_gyros(columns, statements)
    gyros = {name: one for name in GYRO_NAMES if (one := named(columns, name)) is not None}
    if not gyros:
        rates = units.RATE_UNITS
        possible = [one for one in columns if units.split_factor(one.unit or "")[1] in rates]
        if not possible:
            # Columns of one array, such as gyro.1, gyro.2 and gyro.3.
            possible = [one for one in columns if _GYRO.search(one.name) and _may_be_gyro(one)]
            possible = possible if len(possible) == len(GYRO_NAMES) else []
        if not possible:
            others = candidates(source, statements)
            possible = list(others) if len(others) == 1 or _is_plain(columns) else []
            if len(possible) >= 2 * len(GYRO_NAMES):
                first, second = possible[:3], possible[3:6]
                # Many loggers write accelerometers first.
                is_behind = _shows_gravity(source, first) and not _shows_gravity(source, second)
                possible = second if is_behind else first
        gyros = dict(zip(GYRO_NAMES, possible, strict=False))
    stated = {name: column_text(one) for name, one in gyros.items()}
    missing["columns"] = text_of(stated or {"x": "COLUMN"})
    return gyros


def _is_plain(columns: Columns) -> bool:
    """Whether columns have numbers alone: of a table without names, or of the only array."""
    numbers = [one.key.rpartition(".") for one in columns]
    is_counted = [last for *_, last in numbers] == [str(1 + n) for n in range(len(columns))]
    return is_counted and len({stem for stem, *_ in numbers}) == 1


def _shows_gravity(source: Source, columns: Columns) -> bool:
    """Whether three columns without names are as long as gravity, in m/s², g or mg."""
    numbers = _first_numbers(source, columns)
    size = float(np.median(np.linalg.norm([numbers[one.key] for one in columns], axis=0)))
    return any(abs(size / one - 1.0) < 0.05 for one in (units.STANDARD_GRAVITY, 1.0, 1e3))


def _first_numbers(source: Source, columns: Columns, *, by_first: bool = False) -> Values:
    """Key -> the first values of each column."""
    keys = [one.key for one in columns]
    stored = source.opened(keys)
    # By ten thousand samples a column that only rises, falls or stays is known to be no gyro.
    return stored.read(keys, 0, min(10_000, *stored.lengths.values()), by_first=by_first)


def candidates(source: Source, statements: Statements) -> tuple[Column, ...]:
    """Columns that may be gyros, since nothing says that they are anything else.

    Not those of another name or unit, nor those that only rise, fall or stay.

    Parameters
    ----------
    source, statements
        As for `suggestion`.
    """
    table = choose_one(source.columns, statements, "table")
    time, _ = choice.choose_time(source.columns, statements)
    taken = {one.key for one in (table, time) if one is not None}
    left = [one for one in source.columns if one.key not in taken and _is_no_other(one)]
    return tuple(_wandering(source, left))


def _wandering(source: Source, columns: Columns) -> Iterator[Column]:
    """Those of the columns whose numbers both rise and fall."""
    if not columns:
        return
    try:
        numbers = _first_numbers(source, columns, by_first=True)
    except RecordingError:
        # A column of words spoils all that are read with it.
        for one in columns if len(columns) > 1 else ():
            yield from _wandering(source, [one])
        return
    for one in columns:
        if set(np.sign(np.diff(numbers[one.key])).tolist()) >= {-1.0, 1.0}:
            yield one


def column_text(column: Column) -> str:
    """How a column is named in a list of them: by its number if its name holds a mark of lists."""
    return str(column.number) if set(column.key) & set(",=\"'") and column.number else column.key


def _kind_and_unit(gyros: Mapping[str, Column], statements: Statements, missing: Inputs) -> None:
    inputs = {"kind": dict.fromkeys(gyros, ""), "unit": dict.fromkeys(gyros, "")}
    is_sized = statements.first("scale") is not None
    for name, column in gyros.items():
        unit = next(filter(None, choice.stated_for("unit", name, column, statements)), None)
        # A name is a hint, so what it says is to be stated.
        named = None if unit else choice.unit_in_name(column.name, "rate")
        if not is_known(unit or ""):
            inputs["unit"][name] = (named or UNIT) if not is_sized else "counts" if unit else ""
        if not is_sized and is_counts(unit or ""):
            missing["scale"] = "SIZE"
        if not any(choice.stated_for("kind", name, column, statements)):
            is_rate = units.split_factor(unit or named or "")[1] in units.RATE_UNITS
            inputs["kind"][name] = "rate" if is_rate else KIND
    for quantity, unknown in (("kind", KIND), ("unit", UNIT)):
        guessed = inputs[quantity]
        values = set(guessed.values()) or {unknown}
        by_name = text_of({name: one for name, one in guessed.items() if one})
        if text := values.pop() if len(values) == 1 else by_name:
            missing[quantity] = text


def _unit_of_forces(columns: Columns, statements: Statements, missing: Inputs) -> None:
    """A unit of the accelerometers that are stated, beside that of the gyros."""
    forces = choice.stated_sensors(columns, statements, "accelerometers")
    units_of = partial(choice.stated_for, "unit", statements=statements, sensor="accelerometer")
    if all(any(units_of(name, one)) for name, one in forces.items()):
        return
    of_gyros = missing.get("unit", text_of(statements.caller.unit or ""))
    if of_gyros and "=" not in of_gyros:
        of_gyros = f"gyros={of_gyros}"
    missing["unit"] = ",".join(filter(None, (of_gyros, f"accelerometers={UNIT}")))


def _sampling(source: Source, statements: Statements, taken: Collection[str]) -> Inputs:
    """The time or the rate, if neither is stated."""
    columns = source.columns
    chosen, _ = choice.choose_time(columns, statements, taken)
    is_rated = statements.first("sample_rate") is not None
    if chosen is not None and chosen.unit:
        return {}
    like = [one for one in columns if one.key not in taken and is_like_time(one)]
    for one in filter(None, (chosen, *(() if is_rated else like))):
        if text := _time_text(source, one):
            return {"time": text}
    if is_rated:
        return {}
    # The first of several columns without names, if its numbers go up evenly.
    if len(columns) > 1 and _is_plain(columns) and columns[0].key not in taken:
        first = columns[0]
        try:
            steps = _steps(source, first)
        except RecordingError as error:
            if not error.channel:
                raise
            # A word in every row; the times may be after it.
            first = columns[1]
            steps = _steps(source, first) if first.key not in taken else np.empty(0)
        is_even = steps.size > 1 and 0.0 < float(np.max(steps)) < 2.0 * float(np.median(steps))
        if is_even and float(np.min(steps)) >= 0.0 and (text := _time_text(source, first)):
            return {"time": text}
    return {"rate": "HZ"}


def _steps(source: Source, column: Column) -> arrays.FloatArray:
    """Finite steps of a column of stamps, in its own unit."""
    steps = np.diff(source.stamps(column.key))
    return steps[np.isfinite(steps)]


def _time_text(source: Source, column: Column) -> str:
    """A column of times with its unit; empty if it goes 0, 1, 2, …, since it numbers the rows."""
    if column.unit is not None and choice.is_time_unit(column.unit):
        unit = units.canonical(column.unit)
        return f"{column.name}:{unit if unit in units.TIME_UNITS else column.unit}"
    steps = _steps(source, column)
    if steps.size and (steps == 1.0).all():
        return ""
    forward = steps[steps > 0.0]
    likely = suspicions.likely_time_unit(float(np.mean(forward))) if forward.size else None
    return f"{column.name}:{likely or UNIT}"
