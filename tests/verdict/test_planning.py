"""A forecast of the interval against laws, and against what longer recordings give."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.special import ndtr, ndtri

import sagnac
from sagnac.analysis.planning import short_recording
from sagnac.noise.laws import STOCHASTIC_NAMES
from sagnac.rig.config import preset
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum
from sagnac.verdict.forecast import LeftOut, ShortRecording

WHITE = ShortRecording(
    value=1.0,
    low=0.9,
    high=1.1,
    confidence=0.95,
    coefficients={"angle_random_walk": 1.0},
    terms=("angle_random_walk",),
    duration=100.0,
    highest=5.0,
    interval=0.1,
    efficient=True,
)


def test_white_noise_by_hand():
    # 2 T f bins of one degree of freedom: N^2 to sqrt(2/n), N to half of that.
    for duration in (100.0, 7200.0, 1e6):
        by_hand = 0.5 * ndtri(0.975) * np.sqrt(2.0 / (2.0 * duration * 5.0))
        assert WHITE.expected(duration) == pytest.approx(by_hand, rel=1e-3)


@pytest.mark.parametrize("duration", [100.0, 3000.0, 50_000.0])
def test_an_average_heeds_no_bin_beyond_its_own_error(duration):
    average = dataclasses.replace(WHITE, low=0.999, high=1.001, efficient=False)
    # By hand: bins of a tenth of a decade, each with the chance of its cells and an error of 3 %
    # that the weights allow for; of the cells 62 % count, and the variance is 1.1 times as large.
    frequency = np.arange(2, int(2.0 * duration * 5.0) + 1) / (2.0 * duration)
    bins = np.floor(10.0 * np.log10(frequency))
    chance = np.array([1.0 / (0.62 * 0.5 * np.sum(bins == each)) for each in np.unique(bins)])
    weight = 1.0 / (chance + 0.03**2)
    variance = np.sum(weight**2 * chance) / np.sum(weight) ** 2
    by_hand = 0.5 * ndtri(0.975) * np.sqrt(1.1 * variance)
    assert average.expected(duration) == pytest.approx(by_hand, rel=0.01)


def test_an_interval_that_chance_does_not_explain_stays_wider():
    narrow = dataclasses.replace(WHITE, low=0.999, high=1.001, efficient=False)
    wide = dataclasses.replace(narrow, low=0.5, high=2.0)
    # By hand, as above: 5.9 % after 100 s.
    factor = np.log(2.0) / (1.5 * 0.059)
    for duration in (100.0, 1e4):
        wanted = factor * narrow.expected(duration)
        assert wide.expected(duration) == pytest.approx(wanted, rel=0.02)


def test_a_low_pass_in_sight_widens_an_average_and_no_likelihood():
    average = dataclasses.replace(WHITE, low=0.999, high=1.001, efficient=False)
    falls = dataclasses.replace(average, falls=True)
    ratio = falls.expected(1e3) / average.expected(1e3)
    assert ratio == pytest.approx(np.sqrt(1.5 / 1.1), rel=1e-6)
    assert dataclasses.replace(WHITE, falls=True).expected(1e3) == WHITE.expected(1e3)


@pytest.mark.parametrize("samples", [20_000, 200_000])
def test_levels_keep_six_tenths_of_what_cells_tell(samples):
    values = np.random.default_rng(1).standard_normal(samples)
    levels = robust_levels(tapered_spectrum(values, sample_rate=10.0))
    widths = levels.high - levels.low
    # An ordinate of the periodogram, 1/T wide, is exponential: a gamma law of shape one.
    kept = levels.shape / (widths * samples / 10.0)
    assert kept[-5:] == pytest.approx(0.62, rel=0.12)


def test_terms_that_are_fitted_beside_n_take_information():
    beside = dataclasses.replace(WHITE, terms=STOCHASTIC_NAMES)
    assert beside.expected(1e3) > 1.02 * WHITE.expected(1e3)
    # The information by sums over every bin, without groups of bins.
    walk = dataclasses.replace(
        WHITE,
        terms=("angle_random_walk", "rate_random_walk"),
        coefficients={"angle_random_walk": 1.0, "rate_random_walk": 0.1},
    )
    duration = 2000.0
    # The lowest bin goes with the slope.
    frequency = np.arange(2, 20_001) / (2.0 * duration)
    shares = np.stack([np.ones_like(frequency), (2.0 * np.pi * frequency) ** -2.0], axis=1)
    relative = shares / (shares @ [1.0, 0.01])[:, np.newaxis]
    variance = np.linalg.inv(0.5 * relative.T @ relative)[0, 0]
    # The laws are of sampled increments, the sums of the continuous rate.
    assert walk.expected(duration) == pytest.approx(
        0.5 * ndtri(0.975) * np.sqrt(variance), rel=0.01
    )


def test_what_lines_take_shrinks_with_the_duration():
    # A line of 20 cells on either side takes 40/T of a band to 5 Hz.
    lines = tuple(LeftOut(low=f, high=f, cells=20.0) for f in (1.0, 2.0, 3.0, 4.0))
    fewer = dataclasses.replace(WHITE, left_out=lines)
    for duration in (100.0, 1e3, 1e5):
        left = 1.0 - 4.0 * 40.0 / duration / 5.0
        wanted = WHITE.expected(duration) / np.sqrt(left)
        assert fewer.expected(duration) == pytest.approx(wanted, rel=1e-3)
    band = dataclasses.replace(WHITE, left_out=(LeftOut(low=2.0, high=4.0, cells=0.0),))
    assert band.expected(1e5) == pytest.approx(WHITE.expected(1e5) / np.sqrt(0.6), rel=1e-3)
    # Where nothing is left, nothing is known; the duration is found all the same.
    assert fewer.expected(20.0) == np.inf
    assert fewer.expected(fewer.duration_for(0.05)) == pytest.approx(0.05, rel=5e-3)


def test_the_duration_is_that_of_the_width():
    # Bins are whole: at a tenth there are some two hundred.
    for width in (0.03, 0.01):
        assert WHITE.expected(WHITE.duration_for(width)) == pytest.approx(width, rel=5e-3)
    # What the likelihood is to reach in 20 s, this recording has not reached in 100 s.
    assert WHITE.expected(20.0) < 0.1
    assert WHITE.duration_for(0.1) == WHITE.duration
    # An interval that is there already takes no more than there is.
    narrow = dataclasses.replace(WHITE, low=0.97, high=1.03)
    assert narrow.duration_for(0.031) == narrow.duration < narrow.duration_for(0.029)
    # A year is too short, and no recording decides a limit at N.
    assert WHITE.duration_for(1e-6) == np.inf
    assert WHITE.duration_to_decide(1.0) == np.inf


def test_a_limit_is_decided_as_often_as_said():
    # N scatters by one standard error about its truth; its interval is two of them wide each way.
    duration = WHITE.duration_to_decide(1.02)
    half_width = WHITE.expected(duration)
    error = half_width / ndtri(0.975)
    found = np.exp(error * np.random.default_rng(2).standard_normal(20_000))
    decided = found * np.exp(half_width) <= 1.02
    assert decided.mean() == pytest.approx(0.9, abs=0.01)


def test_what_shows_nothing_is_refused():
    with pytest.raises(ValueError, match="must lie within"):
        dataclasses.replace(WHITE, low=1.2)
    with pytest.raises(ValueError, match="terms lacks"):
        dataclasses.replace(WHITE, terms=("quantization",))


def test_from_a_tenth_of_the_record():
    """Walk of the angle and steps of the readout, as a ring laser has them."""
    random, samples = np.random.default_rng(5), 36_000
    angle = np.cumsum(random.standard_normal(samples)) * 7.4e-9 * np.sqrt(0.1)
    angle += 1.4e-9 * random.standard_normal(samples)

    def analyzed(values):
        recording = sagnac.Recording.from_arrays(
            x=values, kind="angle", unit="rad", sample_rate=10.0
        )
        return sagnac.analyze(recording, sagnac.Settings(method="none"))

    whole = short_recording(analyzed(angle))
    forecast = short_recording(analyzed(angle[: samples // 10])).expected(whole.duration)
    assert forecast == pytest.approx(whole.half_width, rel=0.1)


def test_what_unlike_weights_leave_open_is_no_shorter_for_time():
    open_pair = dataclasses.replace(WHITE, apart=0.02)
    assert open_pair.expected(1e9) == pytest.approx(0.01, rel=0.02)
    for duration in (100.0, 7200.0):
        # Beside an end of what is open, the interval holds that end as often as asked for.
        one = WHITE.expected(duration) / ndtri(0.975)
        beyond = (open_pair.expected(duration) - 0.01) / one
        assert ndtr(beyond + 0.02 / one) - ndtr(-beyond) == pytest.approx(0.95, abs=1e-6)


@pytest.mark.parametrize("deviation", [0.001, 0.01])
def test_from_a_tenth_that_lines_leave_little_of(deviation):
    """On a table the lines take much of a tenth and little of the whole; shares leave N open."""
    base = preset("paper")
    tones = tuple(line for line in base.disturbances.time if line[0] < 25.0)
    config = dataclasses.replace(
        base,
        seed=3,
        duration_s=3000.0,
        sample_rate_hz=50.0,
        disturbances=dataclasses.replace(base.disturbances, time=tones),
        platform=dataclasses.replace(base.platform, share_deviation=(deviation, 0.0, -deviation)),
    )
    recording = sagnac.simulate(config).recording

    def analyzed(samples):
        part = dataclasses.replace(
            recording,
            gyros=tuple(
                dataclasses.replace(one, values=one.values[:samples]) for one in recording.gyros
            ),
            table=dataclasses.replace(recording.table, values=recording.table.values[:samples]),
            null_pulse=recording.null_pulse[:samples],
        )
        return sagnac.analyze(part, sagnac.Settings(gyros=("x", "z")))

    early = analyzed(15_000)
    shown = short_recording(early)
    assert len(shown.left_out) > 10
    whole = analyzed(150_000)
    assert whole.average.member == early.average.member == "whole band"
    found = short_recording(whole)
    assert shown.expected(found.duration) == pytest.approx(found.half_width, rel=0.1)


def test_an_average_that_a_low_pass_keeps_stays_an_average():
    """The likelihood does not see that the spectrum falls within its band."""
    random, rate = np.random.default_rng(7), 50.0
    white = random.standard_normal(30_000)
    decay = np.exp(-2.0 * np.pi * 1.0 / rate)
    low_passed = lfilter([1.0 - decay], [1.0, -decay], white)
    recording = sagnac.Recording.from_arrays(
        x=low_passed, kind="rate", unit="deg/s", sample_rate=rate
    )
    shown = short_recording(sagnac.analyze(recording, sagnac.Settings(method="none")))
    assert not shown.efficient
    assert shown.highest < 5.0
