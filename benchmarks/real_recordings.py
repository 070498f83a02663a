"""Real gyros: every channel of some public recordings, each answer beside a multitaper spectrum.

    python -m benchmarks.real_recordings FOLDER [--only TEXT] [--page FILE]

FOLDER holds the recordings, which are not part of the project: `SOURCES` names their files and
where they are from. The spectrum is made by scipy's Slepian tapers of the raw samples, not by the
package. A known angle random walk of 2 and 5 times the answer is put on top of every channel: the
answer has to hold what both make together.
"""

import argparse
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.io import loadmat
from scipy.signal.windows import dpss

from benchmarks.stability import PAGE as STABILITY_PAGE
from sagnac.analysis.pipeline import still_bench
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Settings
from sagnac.core.arrays import FloatArray
from sagnac.core.units import DEGREE_PER_HOUR_PER_ROOT_HERTZ, DEGREE_PER_ROOT_HOUR
from sagnac.formats.read_write import read
from sagnac.noise.estimates import Estimate
from sagnac.recording.channel import angle_of
from sagnac.recording.model import Recording

DOCS: Final = STABILITY_PAGE.parent
PAGE: Final = DOCS / "real_recordings.md"
SEED: Final = 20261122
# The walk put on top, in units of the answer.
ADDED: Final = (2.0, 5.0)
# The spectrum in the pictures: its time-bandwidth product, tapers and bins a decade.
# Seven tapers of 4 would leak so much of a dither that the LN-100 shows it as a plateau.
BANDWIDTH: Final = 6.0
TAPERS: Final = 7
BINS: Final = 24
# Dots per inch: pictures of three channels stay below 80 kB.
DPI: Final = 80

SOURCES: Final = """\
- **LN-100**: a dithered ring-laser unit at rest, 64 Hz, 300 s; `data/x_LN100_up.ins` of
  github.com/talhaitis/Ins-Calibration (MIT).
- **ADI**: a MEMS unit at rest with a low-pass of its own, 100 Hz, 36 s; `data/x_adi_up.txt` of the
  same.
- **PSINS**: a ring-laser strapdown unit at rest, with sway, 100 Hz, 1847 s, quiet from 630 to
  930 s; `data/lasergyro.imu` of github.com/WangShanpeng/PSINS (Gongmin Yan, BSD 2-clause).
- **MPU6050**: a MEMS unit that stands beside a motor shaft, 99.9 Hz, 1500 s; `MatlabCode/Data` of
  github.com/ssong47/compute_relative_angle_between_two_IMUs (MIT).
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A recording at rest with its name in the page and in the names of files."""

    name: str
    file: str
    recording: Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class Added:
    """What came out with a known walk on top, rad/sqrt(s): expected range and answer."""

    times: float
    least: float
    most: float
    answer: Estimate

    @property
    def found(self) -> bool:
        """Whether the answer is an estimate that holds what was expected, or bounds it."""
        return self.answer.low <= self.most and self.least <= self.answer.high


@dataclass(frozen=True, slots=True, kw_only=True)
class Answered:
    """A channel with its analysis, with those of its halves, and with a walk on top."""

    source: Source
    gyro: str
    analysis: Analysis
    halves: tuple[Estimate, ...]
    added: tuple[Added, ...]

    @property
    def halves_agree(self) -> bool:
        """Whether the interval of each half meets that of the whole."""
        whole = self.analysis.angle_random_walk
        return all(not (half.low > whole.high or half.high < whole.low) for half in self.halves)


def sources(folder: Path) -> Iterator[Source]:
    """The recordings that lie in a folder."""
    rates = np.fromfile(folder / "calibration_ln100_adi" / "x_LN100_up.ins", "<f8").reshape(-1, 7)
    yield _of_rates("LN-100", "ln100", rates[:, 1:4], 64.05)
    table = np.loadtxt(folder / "calibration_ln100_adi" / "x_adi_up.txt")
    yield _of_rates("ADI", "adi", table[:, 1:4], 100.0)
    laser = folder / "psins_lasergyro" / "lasergyro.imu"
    yield Source(name="PSINS, all", file="psins", recording=read(laser))
    quiet = read(laser, span=(630.0, 930.0))
    yield Source(name="PSINS, 630 to 930 s", file="psins_quiet", recording=quiet)
    for speed in ("slow", "medium"):
        data = loadmat(folder / "turntable_mpu6050" / f"raw_yaw_{speed}.mat")
        columns = np.column_stack([data[f"all_gyro_1_{axis}"].ravel() for axis in "xyz"])
        yield _of_rates(f"MPU6050, {speed}", f"mpu6050_{speed}", columns, 99.9)


def _of_rates(name: str, file: str, rates: FloatArray, sample_rate: float) -> Source:
    gyros = dict(zip("xyz", np.ascontiguousarray(rates.T), strict=True))
    recording = Recording.from_arrays(**gyros, kind="rate", unit="deg/s", sample_rate=sample_rate)
    return Source(name=name, file=file, recording=recording)


def answered(source: Source, gyro: str) -> Answered:
    """The answer of a channel, alone and with a known walk on top."""
    analysis = _answer(source.recording, gyro)
    walk = analysis.angle_random_walk
    angle = np.asarray(angle_of(source.recording.gyro(gyro), source.recording.sample_rate))
    middle = angle.size // 2
    halves = tuple(
        _answer(_of_angle(gyro, half, source.recording.sample_rate), gyro).angle_random_walk
        for half in (angle[:middle], angle[middle:])
    )
    if walk.status == "not observable":
        return Answered(source=source, gyro=gyro, analysis=analysis, halves=halves, added=())
    rng = np.random.default_rng([SEED, ord(gyro)])
    white = rng.standard_normal(angle.size) / math.sqrt(source.recording.sample_rate)
    added = []
    for times in ADDED:
        known = times * walk.value
        noisy = _of_angle(gyro, angle + known * np.cumsum(white), source.recording.sample_rate)
        added.append(
            Added(
                times=times,
                least=math.hypot(walk.low, known),
                most=math.hypot(walk.high, known),
                answer=_answer(noisy, gyro).angle_random_walk,
            )
        )
    return Answered(source=source, gyro=gyro, analysis=analysis, halves=halves, added=tuple(added))


def _of_angle(gyro: str, angle: FloatArray, sample_rate: float) -> Recording:
    return Recording.from_arrays(
        **{gyro: angle - angle[0]}, kind="angle", unit="rad", sample_rate=sample_rate
    )


def _answer(recording: Recording, gyro: str) -> Analysis:
    # As `sagnac avar` does: every sample.
    settings = Settings(gyros=(gyro,), method="none", interval=None)
    return still_bench(recording, settings)[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Density:
    """Root of a one-sided rate density, deg/h/sqrt(Hz), in logarithmic bins."""

    frequency: FloatArray
    root: FloatArray


def slepian_density(recording: Recording, gyro: str) -> Density:
    """Median of a Slepian multitaper spectrum in logarithmic bins."""
    rate = recording.sample_rate
    steps = np.diff(angle_of(recording.gyro(gyro), rate)) * rate
    steps = steps - np.polyval(np.polyfit(np.arange(steps.size), steps, 1), np.arange(steps.size))
    tapers = dpss(steps.size, BANDWIDTH, TAPERS)
    power = np.mean(np.abs(np.fft.rfft(tapers * steps, axis=1)) ** 2, axis=0) * 2.0 / rate
    first = int(BANDWIDTH) + 1
    frequency = np.arange(first, power.size) * rate / steps.size
    index = np.floor(BINS * np.log10(frequency)).astype(int)
    bins = np.unique(index)
    return Density(
        frequency=np.array([np.median(frequency[index == one]) for one in bins]),
        root=np.sqrt([np.median(power[first:][index == one]) for one in bins])
        / DEGREE_PER_HOUR_PER_ROOT_HERTZ,
    )


def draw(axes: Axes, one: Answered) -> None:
    """The spectrum of a channel, and where the answer lies on it."""
    seen = slepian_density(one.source.recording, one.gyro)
    axes.loglog(seen.frequency, seen.root, color="#1f5a96", linewidth=0.8)
    walk = one.analysis.angle_random_walk
    scale = math.sqrt(2.0) / DEGREE_PER_HOUR_PER_ROOT_HERTZ
    low, high = one.analysis.average.band_hz if one.analysis.average else (math.nan, math.nan)
    if walk.status == "estimated":
        span = (low, high) if high > 0.0 else (seen.frequency[0], seen.frequency[-1])
        span = (max(span[0], seen.frequency[0]), span[1])
        axes.fill_between(span, scale * walk.low, scale * walk.high, color="#c4561b", alpha=0.3)
        axes.plot(span, [scale * walk.value] * 2, color="#c4561b", linewidth=1.6)
    elif walk.status == "upper bound":
        axes.axhline(scale * walk.high, color="#c4561b", linestyle="--", linewidth=1.2)
    axes.set_title(f"{one.source.name}, {one.gyro}: {in_words(walk)}", fontsize=8)
    axes.set_xlabel("frequency (Hz)", fontsize=8)
    axes.tick_params(labelsize=7)


def in_words(walk: Estimate) -> str:
    """An answer in deg/sqrt(h)."""
    value, low, high = (one / DEGREE_PER_ROOT_HOUR for one in (walk.value, walk.low, walk.high))
    if walk.status == "estimated":
        return f"{value:.3g} [{low:.3g}, {high:.3g}] °/√h"
    return f"< {high:.3g} °/√h" if walk.status == "upper bound" else "not observable"


def row(one: Answered) -> str:
    """A row of the table."""
    choice = one.analysis.average
    on = choice.in_words() if choice is not None and choice.terms else "–"
    parts = [part for part in one.analysis.parts if not math.isnan(part.value)]
    reach = "–"
    if parts:
        values = [part.value / DEGREE_PER_ROOT_HOUR for part in parts]
        changes = any("random walk changes" in note.text for note in one.analysis.notes)
        reach = f"{min(values):.2g} to {max(values):.2g}{', changes' if changes else ''}"
    found = [f"{'yes' if each.found else 'no'}: {in_words(each.answer)}" for each in one.added]
    halves = f"{'yes' if one.halves_agree else 'no'}: {'; '.join(map(in_words, one.halves))}"
    cells = [one.source.name, one.gyro, in_words(one.analysis.angle_random_walk), on, reach, halves]
    return f"| {' | '.join([*cells, *(found or ['–'] * len(ADDED))])} |"


def picture(answers: Sequence[Answered], path: Path) -> None:
    """The channels of one recording side by side."""
    figure = Figure(figsize=(3.6 * len(answers), 2.9), layout="constrained")
    for axes, one in zip(np.atleast_1d(figure.subplots(1, len(answers))), answers, strict=True):
        draw(axes, one)
    figure.axes[0].set_ylabel("rate noise density (°/h/√Hz)", fontsize=8)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})


TEXT: Final = """\
# Real gyros

Made by `python -m benchmarks.real_recordings FOLDER`. What `sagnac avar` answers for every channel
of some public recordings, which are not part of the project:

{sources}
In each picture the blue line is a multitaper spectrum of the raw samples by scipy's Slepian tapers
(NW {bandwidth:g}, {tapers} tapers, medians of {bins} bins a decade). The orange line is the answer
as a density, √2 N, over the band that it rests on, with its interval; a dashed line is an upper
bound. Lines are still in the blue spectrum; the answer is the one with the lines out.

"Parts" are the N of parts of the recording in °/√h, by the band and terms of the whole; *changes*
where they, or their spectra, differ by more than chance. "Halves" are analyzed as recordings of
their own: *yes* if the interval of each meets that of the whole. In the last two columns a known
angle random walk of 2 and 5 times the answer was put on top: *yes* if the new answer holds both
together.

| recording | gyro | answer | rests on | parts | halves | 2 N on top | 5 N on top |
|---|---|---|---|---|---|---|---|
{rows}

The LN-100's answers lie on the plateau that is left below 0.3 Hz. Slepian tapers of NW 4 leak so
much of its dither that they show a plateau at twice the height. The value for y of the ADI is low:
from 2 Hz on B passes for the low-pass; the interval reaches over the plateau, 0.035 °/√h, of these
36 s. Of PSINS the sway of the bench reaches the lowest frequencies of the whole recording: what is
read there, 0.06 °/√h for z, is N of gyro and bench together, and only the quiet stretch,
0.009 °/√h, shows the gyro. For z a warning names the hump at 2.8 Hz and the lower level behind it.
The slow MPU6050's z is four times as loud in the first half as in the second, and the interval of
the whole reaches over both; the motor beside it makes bursts, which are part of its N, and turns it
by up to 0.4° in single seconds, without which the answer goes. The spectrum of the x of the medium
MPU6050 falls from that of 2.5 °/√h at 0.01 Hz to that of 0.3 to 0.4 °/√h from 1 Hz on, where it is
level; the answer is what is level there.

{pictures}
"""


def main(arguments: Sequence[str]) -> None:
    """Answers, pictures and the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="where the recordings lie")
    parser.add_argument("--only", default="", help="recordings whose name contains this")
    parser.add_argument("--page", type=Path, default=PAGE, help="page to write")
    given = parser.parse_args(arguments)
    if given.folder is None:
        print("real_recordings: no folder of recordings was given, nothing is done")
        return
    rows, pictures = [], []
    for source in sources(given.folder):
        if given.only not in source.name:
            continue
        answers = []
        for gyro in (channel.name for channel in source.recording.gyros):
            answers.append(answered(source, gyro))
            rows.append(row(answers[-1]))
            print(rows[-1], flush=True)
        path = given.page.with_name(f"real_{source.file}.png")
        picture(answers, path)
        pictures.append(f"![{source.name}]({path.name})")
    given.page.write_text(
        TEXT.format(
            sources=SOURCES,
            bandwidth=BANDWIDTH,
            tapers=TAPERS,
            bins=BINS,
            rows="\n".join(rows),
            pictures="\n\n".join(pictures),
        ),
        encoding="utf-8",
    )


if __name__ == "__main__":
    import sys

    main(sys.argv[1:])
