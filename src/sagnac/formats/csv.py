"""Text tables: any usual mark between fields, numbers and times as instruments write them.

A folder of EuRoC holds one, ``mav0/imu0/data.csv`` with the six axes of an IMU, and its
``sensor.yaml``. Layout, header and keys are those of the data set's own description (Burri et al.,
The EuRoC micro aerial vehicle datasets, *Int. J. Robot. Res.* 35, 1157, 2016; ASL format).
"""

import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as arrow_csv

from sagnac.core import units, whole_files
from sagnac.core.arrays import AnyArray, blocks
from sagnac.core.errors import Note, RecordingError
from sagnac.core.texts import toml_table
from sagnac.formats.files import AGAIN
from sagnac.formats.registry import EUROC, EUROC_DATA, EUROC_SENSOR
from sagnac.formats.source import MADE, Outgoing, Rows, Source
from sagnac.formats.text import MISSING, NumberStyle, nanoseconds, past_midnight, text_file
from sagnac.formats.text_layout import COMMENT, PRESETS, Form, Layout, layout

# That many blocks are read side by side.
_THREADS: Final = 2
_FIRST_FIELDS: Final = 6


def open_source(path: Path) -> Source:
    """Columns by the header of the file, or by number.

    Raises
    ------
    RecordingError
        If the file is not text or has no lines.
    """
    return source_of(layout(text_file(path)))


def source_of(laid_out: Layout) -> Source:
    """The columns of a text file of that layout."""

    def load(keys: Sequence[str]) -> dict[str, AnyArray]:
        wanted = {one.key: one.number - 1 for one in laid_out.columns if one.key in keys}
        if not laid_out.first_row:
            return {key: np.empty(0) for key in keys}
        arrays = _parsed(laid_out, wanted)
        last = laid_out.columns[-1].key
        if not laid_out.text.is_ended and last in arrays:
            check_last(last, arrays[last])
        return arrays

    notes = _notes(laid_out)
    return Source(columns=laid_out.columns, load=load, stated=laid_out.stated, notes=notes)


def _notes(laid_out: Layout) -> tuple[Note, ...]:
    notes, style, row = [], laid_out.style, laid_out.first_row
    if laid_out.doubts:
        texts = [f"{style.value(one):.10g}" if style.holds(one) else one for one in row]
        pairs = zip(laid_out.columns, texts, strict=True)
        shown = ", ".join(f"{column.key} = {text}" for column, text in islice(pairs, _FIRST_FIELDS))
        more = " ..." if len(texts) > _FIRST_FIELDS else ""
        problem = f"read with {', '.join(laid_out.doubts)}; the first row: {shown}{more}"
        notes.append(Note(text=problem))
    if not laid_out.text.is_ended:
        notes.append(Note(text="the last line has no line end: it may be cut off", level="warning"))
    return tuple(notes)


def check_last(name: str, values: AnyArray) -> None:
    """Refuse a last number that is cut short: it leaps twice as far as any shortly before.

    Raises
    ------
    RecordingError
        If it does.
    """
    steps = np.abs(np.diff(values[-1000:]))
    if steps.size > 1 and steps[-1] > 2.0 * steps[:-1].max():
        remedy = f"remove it, or {AGAIN}"
        raise RecordingError("the last line is cut off", channel=name, remedy=remedy)


# ---- numbers -----------------------------------------------------------------------


def _parsed(laid_out: Layout, wanted: Mapping[str, int]) -> dict[str, AnyArray]:
    """The wanted columns: key -> values, integers where a float would lose digits.

    `wanted` has the place of each.
    """
    forms = {key: laid_out.forms[place] for key, place in wanted.items()}
    parts: dict[str, list[AnyArray]] = {key: [] for key in wanted}
    try:
        for batch in _batches(laid_out, wanted):
            for key, form in forms.items():
                parts[key].append(_values(batch.column(str(wanted[key])), form, laid_out.style))
    except (pa.ArrowInvalid, ValueError) as error:
        wrong = laid_out.fault(wanted)
        if wrong is None:
            raise
        raise wrong from error
    # One after the other, so that no more than one column is in memory twice.
    arrays = {key: np.concatenate(parts.pop(key)) for key in forms}
    return arrays | {key: past_midnight(arrays[key]) for key in forms if forms[key] == "clock"}


def _batches(laid_out: Layout, wanted: Mapping[str, int]) -> Iterator[pa.RecordBatch]:
    """Blocks of text as rows.

    The library's reader of a whole file leaves threads behind when it fails, which call Python
    while the interpreter ends: the process aborts or hangs. So it gets one block of its own memory
    at a time and reads it in the thread that calls it; those threads are ours and end here.
    """
    number = pa.string() if laid_out.style.thousands else pa.float64()
    types = {"number": number, "integer": pa.int64()}
    parse = arrow_csv.ParseOptions(delimiter=laid_out.delimiter, invalid_row_handler=_odd_row)
    forms = {str(place): laid_out.forms[place] for place in wanted.values()}
    convert = arrow_csv.ConvertOptions(
        include_columns=list(forms),
        column_types={name: types.get(form, pa.string()) for name, form in forms.items()},
        decimal_point=laid_out.style.decimal,
        # An empty field may be as wide as its column.
        null_values=[*MISSING, *(" " * width for width in range(1, 33))],
        true_values=[],
        false_values=[],
    )
    names = [str(place) for place in range(len(laid_out.forms))]

    def table(block: bytes, skip: int) -> pa.Table:
        # A comment may have as many fields as a row.
        if b"#" in block or b"%" in block:
            block = re.sub(rb"(?m)^[ \t]*[#%].*", b"", block)
        held = pa.BufferOutputStream()
        held.write(block)
        read = arrow_csv.ReadOptions(
            use_threads=False, column_names=names, skip_rows=skip, block_size=len(block) + 1
        )
        return arrow_csv.read_csv(pa.BufferReader(held.getvalue()), read, parse, convert)

    skip = laid_out.skip
    ahead: deque[Future[pa.Table]] = deque()
    with ThreadPoolExecutor(max_workers=_THREADS) as pool:
        for block in laid_out.text.blocks(blanks=laid_out.delimiter == " "):
            ahead.append(pool.submit(table, block, skip))
            skip = 0
            if len(ahead) > _THREADS:
                yield from ahead.popleft().result().to_batches()
        for one in ahead:
            yield from one.result().to_batches()


def _odd_row(row: Any) -> str:
    """Skip a row of another number of fields if it is blank or a comment, else: an error."""
    text = row.text.strip()
    return "skip" if not text or text.startswith(COMMENT) else "error"


def _values(read: Any, form: Form, style: NumberStyle) -> AnyArray:
    """A piece of a column as numbers, times in ns."""
    if form in ("clock", "iso", "iso-day-first"):
        return nanoseconds(read, form)
    if form == "integer" and read.null_count:
        raise ValueError("an integer is missing")
    if pa.types.is_string(read.type):
        text = pc.utf8_trim_whitespace(read)
        text = pc.if_else(pc.is_in(text, value_set=pa.array(sorted(MISSING))), None, text)
        # Without the mark "12,5" would be 125.
        if not pc.all(pc.match_substring_regex(text, style.pattern), min_count=0).as_py():
            raise ValueError("a mark between thousands stands elsewhere")
        plain = pc.replace_substring(text, style.thousands, "")
        read = pc.replace_substring(plain, style.decimal, ".").cast(pa.float64())
    return np.asarray(read.to_numpy(zero_copy_only=False))


# ---- write -------------------------------------------------------------------------


def write(path: Path, out: Outgoing) -> None:
    """The columns with ``name[unit]`` headers, and ``FILE.toml`` stating kind and rate.

    By its suffix, a folder of EuRoC: see `write_euroc`.
    """
    if path.suffix.lower() in EUROC.suffixes:
        write_euroc(path, out)
        return
    delimiter = "\t" if path.suffix.lower() == ".tsv" else ","
    headers = [name if unit is None else f"{name}[{unit}]" for name, unit in out.units.items()]
    stated = {"gyros": out.gyros, "accelerometers": out.accelerometers, "kind": out.kinds}
    stated = {key: value for key, value in stated.items() if value}
    with whole_files.replacing_set(path) as folder:
        text = f"# {MADE}\n{toml_table({**stated, 'sample_rate': out.sample_rate})}"
        (folder / f"{path.name}.toml").write_text(text, encoding="utf-8")
        _write_table(folder / path.name, headers, map(out.rows, blocks(out.samples)), delimiter)


def _write_table(path: Path, headers: Sequence[str], parts: Iterable[Rows], delimiter: str) -> None:
    """A header, and the rows of each part."""
    plain = arrow_csv.WriteOptions(include_header=False, delimiter=delimiter, quoting_style="none")
    with path.open("wb") as stream:
        stream.write((delimiter.join(headers) + "\n").encode())
        for rows in parts:
            arrow_csv.write_csv(pa.table(rows), stream, plain)


_TIME, _, _RATE, _FORCE = PRESETS[0]
_HEADERS: Final = (f"#{_TIME}", *map(_RATE.format, "xyz"), *map(_FORCE.format, "xyz"))


def write_euroc(
    path: Path, out: Outgoing, densities: Mapping[units.Sensor, tuple[float, float]] | None = None
) -> None:
    """A folder of EuRoC, with the rates in SI.

    Parameters
    ----------
    path
        Of the folder.
    out
        Rates of three gyros and three accelerometers.
    densities
        N and K of the gyros and of the accelerometers, SI, if they are known.
    """
    comment = "noise densities are not known" if densities is None else "noise is as simulated"
    with whole_files.replacing_folder(path) as folder:
        (folder / EUROC_SENSOR).parent.mkdir(parents=True)
        texts = files("sagnac.formats")
        stated = texts.joinpath("euroc_sensor.yaml").read_text(encoding="utf-8")
        stated = stated.format(made=MADE, comment=comment, rate=out.sample_rate)
        if densities is not None:
            known = texts.joinpath("euroc_densities.yaml").read_text(encoding="utf-8")
            stated += "\n" + known.format(**{str(one): each for one, each in densities.items()})
        (folder / EUROC_SENSOR).write_text(stated, encoding="utf-8")

        def rows(block: slice) -> Rows:
            rates = [out.columns[name][block] for name in (*out.gyros, *out.accelerometers)]
            return dict(zip(_HEADERS, (out.stamps(block), *rates), strict=True))

        _write_table(folder / EUROC_DATA, _HEADERS, map(rows, blocks(out.samples)), ",")
