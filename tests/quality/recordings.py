"""Recordings that are sound, and some whose fault is known because it was put in."""

from dataclasses import replace
from functools import cache

import numpy as np

from sagnac.core import arrays
from sagnac.quality.check import check
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording

DEGREE = np.pi / 180.0
RATE = 100.0
SAMPLES = 20_000
SECONDS = np.arange(SAMPLES) / RATE
STEADY = np.full(SAMPLES, 40.0)
BACK_AND_FORTH = 46.0 * np.sign(np.sin(2.0 * np.pi * SECONDS / 7.81) + 1e-9)
MOTIONS = {"steady": STEADY, "back and forth": BACK_AND_FORTH}


def noise(scale: float, seed: int = 0) -> np.ndarray:
    return scale * np.random.default_rng(seed).normal(size=SAMPLES)


def rate_gyro(values: np.ndarray, name: str = "x") -> Channel:
    return Channel(name=name, kind="rate", shown_in="deg/s", values=values * DEGREE)


def turning(rate: np.ndarray, share: float, seed: int = 0) -> Recording:
    """A gyro that senses `share` of `rate` (deg/s), and the encoder that went with it."""
    table = np.cumsum(rate) / RATE * DEGREE
    return Recording(
        gyros=(rate_gyro(share * rate + noise(0.05, seed)),),
        sample_rate=RATE,
        table=Channel(name="table", kind="angle", shown_in="deg", values=table),
    )


def with_table(recording: Recording, values: np.ndarray) -> Recording:
    table = Channel(name="table", kind="angle", shown_in="deg", values=values)
    return Recording(gyros=recording.gyros, sample_rate=RATE, table=table)


def levels(recording: Recording) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {"error": [], "warning": [], "remark": []}
    for finding in check(recording):
        assert "\n" not in str(finding)
        found[finding.level].append(str(finding))
    return found


@cache
def faulty() -> dict[str, Recording]:
    """Good and bad recordings whose faults lie on and across the borders of spans."""
    size = 3000
    random = np.random.default_rng(12)
    white = random.normal(size=size)
    seconds = np.arange(size) / RATE

    def still(values, kind="rate", times=None, unit=1e-3):
        gyro = Channel(name="x", kind=kind, values=unit * values)
        return Recording(gyros=(gyro,), sample_rate=RATE, times=times)

    def turned(rate, table_rate):
        gyro = rate_gyro(0.577 * rate + 0.05 * white)
        table = np.cumsum(table_rate) / RATE * DEGREE
        channel = Channel(name="table", kind="angle", shown_in="deg", values=table)
        return Recording(gyros=(gyro,), sample_rate=RATE, table=channel)

    def changed(values, *changes):
        values = values.copy()
        for place, value in changes:
            values[place] = value
        return values

    steady = np.full(size, 40.0)
    late = seconds + 0.2 / RATE * random.uniform(-1.0, 1.0, size)
    there = np.ones(size, dtype=bool)
    there[970:1015] = there[2000:2007] = False
    nan = np.nan
    return {
        "sound": still(white),
        "sound increments": still(white, kind="increment"),
        "sound angle": still(np.cumsum(white), kind="angle"),
        "turning": turned(steady, steady),
        "reversing": turned(steady * np.sign(np.sin(seconds)), steady * np.sign(np.sin(seconds))),
        "at rest": turned(0.0 * steady, 0.0 * steady),
        "another's encoder": turned(steady, 30.0 * np.sin(seconds)),
        "too fast": turned(60.0 * steady, steady),
        "missing": still(changed(white, (slice(96, 98), nan), (1000, nan), (2999, nan))),
        "mostly missing": still(changed(white, (slice(40, 2960), nan))),
        "infinite": still(changed(white, (999, np.inf))),
        "stuck across borders": still(changed(white, (slice(90, 1110), 0.5))),
        "stuck twice": still(changed(white, (slice(0, 300), 0.5), (slice(1000, 1300), 0.2))),
        "stuck to the end": still(changed(white, (slice(2500, None), 0.5))),
        "stuck throughout": still(0.0 * white),
        "quantized": still(np.rint(0.3 * np.cumsum(white)), kind="angle"),
        "quantized and stuck": still(changed(np.rint(3.0 * white), (slice(997, 1597), 2.0))),
        "jumps": still(changed(white, (slice(97, None), 900.0), (slice(1000, None), 0.0))),
        "saturated": still(np.clip(white, -1.5, 1.2)),
        "few levels": still(np.clip(np.rint(white), -1.0, 1.0)),
        "too quiet": still(white, unit=1e-19),
        "uneven stamps": still(white, times=late),
        "late stamps": still(white, times=changed(late, (slice(97, None), late[97:] + 0.02))),
        "repeated stamps": still(white, times=changed(late, (97, late[96]), (1000, late[999]))),
        "gaps": still(white[there], times=late[there]),
        "gap far too long": still(white, times=changed(late, (slice(97, None), late[97:] + 1e5))),
        "backwards": still(white, times=changed(late, (97, late[95]), (1000, late[998]))),
        "no stamp": still(white, times=changed(late, (slice(97, 99), nan))),
        "coarse clock": still(white, times=np.floor(seconds * 20.0) / 20.0),
    }


def mapped(recording: Recording) -> Recording:
    def moved(values):
        moved = arrays.empty(values.size)
        moved[:] = values
        assert arrays.is_mapped(moved)
        return moved

    def channel(one):
        return replace(one, values=moved(one.values))

    return replace(
        recording,
        gyros=tuple(channel(gyro) for gyro in recording.gyros),
        table=None if recording.table is None else channel(recording.table),
        times=None if recording.times is None else moved(recording.times),
    )
