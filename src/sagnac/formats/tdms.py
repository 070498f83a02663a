"""TDMS files of LabVIEW: channels, with the unit and the rate of their waveforms."""

import logging
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
from nptdms import TdmsFile
from nptdms.log import log_manager

from sagnac.core.arrays import blocks
from sagnac.core.errors import RecordingError
from sagnac.formats import files, source, statement
from sagnac.formats.registry import TDMS
from sagnac.formats.source import Column, Pieces, Source, Stored

# The library hands over raw counts of a channel whose scale it does not know.
_KNOWN_SCALES: Final = frozenset(
    {"Polynomial", "Linear", "RTD", "Strain", "Table", "Thermistor", "Thermocouple", "Add"}
    | {"Subtract", "AdvancedAPI"}
)
_SCALE: Final = re.compile(r"NI_Scale\[\d+\]_Scale_Type$")
# What it warns of is refused here.
log_manager.set_level(logging.CRITICAL)
# Bytes that a segment begins with.
_LEAD_IN: Final = 28
_UNIT_PROPERTIES: Final = ("unit_string", "NI_UnitDescription", "Unit", "unit")


def open_source(path: Path) -> Source:
    """Channels of numbers and times, by name if it is the only one of that name.

    Raises
    ------
    RecordingError
        If the file is not TDMS.
    ValueError
        If it is damaged or cut off.
    """
    _require_whole(path)
    with path.open("rb") as stream, _opened(stream) as file:
        if not file.groups():
            raise ValueError("no segment of it is whole")
        found = [
            (group.name, one.name, dict(one.properties), np.dtype(one.dtype), len(one))
            for group in file.groups()
            for one in group.channels()
        ]
        shared = [file.properties, *(group.properties for group in file.groups())]
    found = [one for one in found if one[3].kind in source.NUMBERS and one[4]]
    often = Counter(name for _, name, *_ in found)
    by_key = {one[1] if often[one[1]] == 1 else f"{one[0]}/{one[1]}": one for one in found}
    columns: list[Column] = []
    for key, (_, _, own, kind, _) in by_key.items():
        unit = next((str(own[one]) for one in _UNIT_PROPERTIES if own.get(one)), None)
        columns.append(source.column(key, unit=source.unit_of(kind) or unit))

    def pieces(keys: Sequence[str], start: int, stop: int) -> Pieces:
        with path.open("rb") as stream, TdmsFile.open(stream) as file:
            for key in keys:
                group, name, *_ = by_key[key]
                channel = file[group][name]
                for block in blocks(stop, start=start):
                    values = channel.read_data(block.start, block.stop - block.start)
                    yield {key: source.as_numbers(values)}

    def load(keys: Sequence[str]) -> Stored:
        for key in keys:
            for holder in (by_key[key][2], *shared):
                check_scales(key, holder)
        return Stored(lengths={key: by_key[key][-1] for key in keys}, pieces=pieces)

    steps = {own["wf_increment"] for _, _, own, *_ in found if own.get("wf_increment")}
    rate = round(1.0 / steps.pop(), 9) if len(steps) == 1 else None
    stated = statement.Statement(sample_rate=rate if rate and rate > 0.0 else None)
    return Source(columns=tuple(columns), load=load, stated=stated)


def _opened(stream: BinaryIO) -> TdmsFile:
    """The file, open.

    Raises
    ------
    ValueError
        If the library fails over it, by whatever error: its words are about its own reading.
    """
    try:
        return TdmsFile.open(stream)
    except Exception as error:
        raise ValueError("the description of its channels cannot be read") from error


def _require_whole(path: Path) -> None:
    """Refuse a file that begins otherwise, or whose last segment is cut off.

    The library leaves such a segment out and says nothing. A segment begins with 28 bytes: tag,
    contents, version, bytes that follow, bytes of metadata.

    Raises
    ------
    RecordingError
        If the first segment has another tag.
    ValueError
        If a later one has, or the last is not all there.
    """
    size, position = path.stat().st_size, 0
    with path.open("rb") as stream:
        while position < size:
            stream.seek(position)
            lead_in = stream.read(_LEAD_IN)
            if not lead_in.startswith(TDMS.beginning):
                if position:
                    raise ValueError(f"no segment begins at byte {position}, where one should")
                problem = "is not TDMS: it does not begin as such a file does"
                remedy = f"give it the suffix of its own format, or {files.AGAIN}"
                raise RecordingError(problem, remedy=remedy)
            # The bit of its contents for the highest byte first.
            is_big = len(lead_in) == _LEAD_IN and lead_in[4] & 0x40
            position += _LEAD_IN + int.from_bytes(lead_in[12:20], "big" if is_big else "little")
    if position > size:
        raise ValueError("its last segment is not all there")


def check_scales(name: str, properties: Mapping[str, Any]) -> None:
    """Refuse a channel with a scale that the library does not know.

    Parameters
    ----------
    name
        Of the channel.
    properties
        Its own, or of what it belongs to.

    Raises
    ------
    RecordingError
        If there is such a scale: the numbers would be raw counts.
    """
    if properties.get("NI_Scaling_Status", "unscaled") == "scaled":
        return
    for key, kind in properties.items():
        if _SCALE.match(key) and kind not in _KNOWN_SCALES:
            problem = f"its scale is of type {kind!r}, which cannot be applied"
            raise RecordingError(problem, channel=name, remedy="write scaled values from LabVIEW")
