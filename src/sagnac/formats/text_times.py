"""Times written as text: of the clock (``14:03:00.002``), and dates with it."""

import re
from typing import Any, Final, Literal

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sagnac import series

TimeForm = Literal["clock", "iso"]

_TIME: Final = r"(?P<h>\d{1,2}):(?P<m>[0-5]\d)(?::(?P<s>[0-5]\d|60)(?:[.,](?P<f>\d{1,9})\d*)?)?"
_HALF: Final = r"\s*(?P<p>[AaPp]\.?[Mm]\.?)?"
_ZONE: Final = r"\s*(?:Z|(?P<z>[+-]\d{2}):?(?P<zm>\d{2}))?"
# Year first as ISO 8601 has it, day first with points, month first with strokes.
_DATES: Final = (
    r"(?P<y>\d{4})[-/.](?P<mo>\d{1,2})[-/.](?P<d>\d{1,2})",
    r"(?P<d>\d{1,2})\.(?P<mo>\d{1,2})\.(?P<y>\d{4})",
    r"(?P<mo>\d{1,2})/(?P<d>\d{1,2})/(?P<y>\d{4})",
)
_CLOCK: Final = rf"^\s*{_TIME}{_HALF}\s*$"
_ISO: Final = tuple(rf"^\s*{date}[T ]+{_TIME}{_HALF}{_ZONE}\s*$" for date in _DATES)
_DAY: Final = 86_400 * 10**9  # ns


def form_of(text: str) -> TimeForm | None:
    """Kind of time that a text is, None if it is none.

    Examples
    --------
    >>> form_of("14:03:00,002"), form_of("2024-03-05T14:03:00Z"), form_of("14.03")
    ('clock', 'iso', None)
    """
    if any(re.match(pattern, text) for pattern in _ISO):
        return "iso"
    return "clock" if re.match(_CLOCK, text) else None


def nanoseconds(texts: Any, form: TimeForm) -> NDArray[np.int64]:
    """Times of an Arrow array of text, ns: from midnight, or from 1970.

    Raises
    ------
    ValueError
        If one is no such time.
    """
    patterns = (_CLOCK,) if form == "clock" else _ISO
    for pattern in patterns:
        parts = pc.extract_regex(texts, pattern)
        if parts.null_count < len(parts) or not len(parts):
            break
    if parts.null_count:
        raise ValueError("a time cannot be read")
    found = _of_day(parts)
    return found if form == "clock" else found + _of_date(parts)


def _number(parts: Any, name: str, width: int = 1) -> NDArray[np.int64]:
    """Digits of a part as numbers, 0 where there are none."""
    digits = pc.utf8_rpad(pc.struct_field(parts, name), width, "0")
    return np.asarray(pc.cast(digits, pa.int64()).to_numpy(zero_copy_only=False))


def _of_day(parts: Any) -> NDArray[np.int64]:
    """Time of the clock, ns."""
    hour = _number(parts, "h")
    half = pc.utf8_lower(pc.struct_field(parts, "p"))
    is_afternoon = pc.starts_with(half, "p").to_numpy(zero_copy_only=False)
    is_morning = pc.starts_with(half, "a").to_numpy(zero_copy_only=False)
    hour = np.where(is_morning | is_afternoon, hour % 12, hour) + 12 * is_afternoon
    seconds = 3600 * hour + 60 * _number(parts, "m") + _number(parts, "s")
    return np.asarray(seconds * 10**9 + _number(parts, "f", 9), dtype=np.int64)


def _of_date(parts: Any) -> NDArray[np.int64]:
    """Midnight of the date in its zone, ns from 1970."""
    year = (_number(parts, "y") - 1970).astype("datetime64[Y]")
    month = year.astype("datetime64[M]") + (_number(parts, "mo") - 1)
    day = month.astype("datetime64[D]") + (_number(parts, "d") - 1)
    zone = np.asarray(pc.struct_field(parts, "z").to_numpy(zero_copy_only=False), dtype=str)
    east = np.where(np.char.startswith(zone, "-"), -1, 1)
    hours = np.where(zone == "", "0", zone).astype(np.int64)
    minutes = 60 * hours + east * _number(parts, "zm")
    midnight = day.astype("datetime64[ns]").astype(np.int64)
    return np.asarray(midnight - minutes * 60 * 10**9, dtype=np.int64)


def past_midnight(times: NDArray[np.int64]) -> NDArray[np.int64]:
    """Times of the clock made continuous, in place: a step back by over half a day is midnight.

    Parameters
    ----------
    times
        (samples,) ns from midnight.
    """
    days = 0
    last = int(times[0]) if times.size else 0
    for start in range(0, times.size, series.SPAN):
        block = times[start : start + series.SPAN]
        back = np.diff(block, prepend=np.int64(last)) < -_DAY // 2
        last = int(block[-1])
        over = np.cumsum(back) + days
        days = int(over[-1])
        block += over * _DAY
    return times
