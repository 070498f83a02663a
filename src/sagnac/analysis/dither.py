"""Gyros whose dither a pick-off shows, stripped of what the gyro's own stripping left."""

import math
from dataclasses import dataclass, replace

from sagnac import series
from sagnac.analysis.settings import Method
from sagnac.errors import Note
from sagnac.lines.stripping import stripped
from sagnac.recording.channel import Pickoff, angle_of
from sagnac.recording.model import Channel, Recording
from sagnac.units import ARCSECOND


@dataclass(frozen=True, slots=True, kw_only=True)
class Undithered:
    """A recording whose gyros are stripped, as angles, and what was taken."""

    recording: Recording
    notes: tuple[Note, ...] = ()


def without_dither(recording: Recording, gyros: tuple[str, ...], method: Method) -> Undithered:
    """Strip the gyros asked for by their pick-offs; with the method ``none`` nothing is taken.

    A pick-off that is not whole or does not move is left alone, with a note.

    Parameters
    ----------
    recording
        Its pick-offs are used if it has any.
    gyros
        Names.
    method
        How periodic parts are removed.
    """
    if method == "none":
        return Undithered(recording=recording)
    channels = {channel.name: channel for channel in recording.gyros}
    notes = []
    for pickoff in recording.pickoffs:
        if pickoff.gyro not in gyros:
            continue
        why = _unusable(pickoff)
        if why:
            text = f"its pick-off {why} and is not used: dither stays in the angle"
            notes.append(Note(level="warning", channel=pickoff.gyro, text=text))
            continue
        gyro = channels[pickoff.gyro]
        found = stripped(angle_of(gyro, recording.sample_rate), pickoff.values)
        channels[gyro.name] = Channel(
            name=gyro.name, kind="angle", shown_in="arcsec", values=found.angle, sensor=gyro.sensor
        )
        text = (
            f"{found.taken / ARCSECOND:.3g} arcsec rms that follows its pick-off was taken out of "
            "the angle: dither that the gyro's own stripping left"
        )
        notes.append(Note(channel=gyro.name, text=text))
    if not notes:
        return Undithered(recording=recording)
    return Undithered(
        recording=replace(recording, gyros=tuple(channels.values())), notes=tuple(notes)
    )


def _unusable(pickoff: Pickoff) -> str:
    """Why a pick-off cannot be used; empty if it can."""
    values = pickoff.values
    if not math.isfinite(series.mean(values)):
        return "has samples that are missing or infinite"
    low, high = series.extent(values)
    return "does not move" if low == high else ""
