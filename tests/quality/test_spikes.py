"""Single samples far off their neighbours."""

import numpy as np
import pytest
from benchmarks.gallery import Gyro, spiked
from scipy.special import ndtri

import sagnac
from sagnac.quality.distribution import find_spikes, without_spikes

RATE = 100.0


def test_spikes_are_found_and_weighed():
    rng = np.random.default_rng(15)
    gyro = spiked(rng, 40_000, RATE, gyro=Gyro(), every=10.0, height=40.0)
    found = find_spikes(gyro.increments, sample_rate=RATE)
    assert 25 <= found.index.size <= 60
    before, after = np.var(gyro.increments), np.var(without_spikes(gyro.increments, found))
    assert after * RATE == pytest.approx(1.0, rel=0.02)
    assert found.added_walk**2 == pytest.approx((before - after) * RATE, rel=0.1)
    assert find_spikes(rng.standard_normal(40_000), sample_rate=RATE).index.size == 0


@pytest.mark.parametrize("freedom", [3, 4, 6])
def test_the_end_of_a_heavy_tail_is_noise(freedom):
    rng = np.random.default_rng(16)
    noise = rng.standard_t(freedom, 90_000)
    found = find_spikes(noise, sample_rate=RATE)
    assert found.tail
    assert found.index.size == 0
    assert found.added_walk == 0.0
    # Spikes of heights of their own stand out of the same noise.
    noise[rng.integers(0, noise.size, 400)] += 400.0
    spiked_too = find_spikes(noise, sample_rate=RATE)
    assert not spiked_too.tail
    assert spiked_too.index.size > 350


@pytest.mark.parametrize("height", [10.0, 40.0, 1000.0])
def test_few_spikes_are_no_tail(height):
    rng = np.random.default_rng(17)
    noise = rng.standard_normal(90_000)
    noise[[1000, 50_000, 70_000]] += height
    found = find_spikes(noise, sample_rate=RATE)
    assert not found.tail
    assert found.index.tolist() == [1000, 50_000, 70_000]


def test_a_spike_is_as_high_as_it_lies_off_the_median_of_its_neighbours():
    rng = np.random.default_rng(3)
    values = rng.standard_normal(2000)
    places = np.array([0, 1, 700, 1998, 1999, *range(800, 1200, 100)])
    values[places] += 1e3
    found = find_spikes(values, sample_rate=RATE)
    around = np.pad(values, 2, mode="reflect")
    naive = [
        values[n] - np.median([*around[n : n + 2], *around[n + 3 : n + 5]])
        for n in range(values.size)
    ]
    # The last but one at either end lies off the mean of its neighbours, if it lies nearer to that.
    for n in (1, values.size - 2):
        naive[n] = min(naive[n], values[n] - 0.5 * (values[n - 1] + values[n + 1]), key=abs)
    assert set(places[2:3].tolist() + list(range(800, 1200, 100))) <= set(found.index.tolist())
    assert found.height == pytest.approx(np.array(naive)[found.index], rel=1e-12)


@pytest.mark.parametrize(("place", "spikes"), [(-1, 1), (-2, 1), (1, 1), (0, 0)])
def test_a_spike_at_the_end_of_a_recording_is_one_too(place, spikes):
    """As of a hand that switches off; the first rate is in no answer. N read up to 11 % high."""
    rates = 0.05 * np.random.default_rng(3).standard_normal(4000)
    rates[place] += 1.0
    recording = sagnac.Recording.from_arrays(x=rates, kind="rate", unit="deg/s", sample_rate=5.0)
    assert [note.name for note in sagnac.check(recording)] == ["spikes"] * spikes
    walk = sagnac.analyze(recording).angle_random_walk.to("deg/sqrt(h)")
    assert walk.value == pytest.approx(60.0 * 0.05 / np.sqrt(5.0), rel=0.05)


@pytest.mark.parametrize("phase", [0.0, 0.8, 1.6, 2.4])
def test_a_strong_line_has_no_spike_where_the_recording_ends(phase):
    noise = np.random.default_rng(9).standard_normal(60_000)
    line = 500.0 * np.sin(2.0 * np.pi * 0.0501 * np.arange(noise.size) + phase)
    assert find_spikes(line + noise, sample_rate=1000.0).index.size == 0


@pytest.mark.parametrize("samples", [60_000, 2**16 + 1, 2**16 + 2])
@pytest.mark.parametrize(("place", "height"), [(0, 0.0), (1000, 1e3), (-1000, -1e3)])
def test_a_table_that_sweeps_has_no_spike_where_the_recording_ends(samples, place, height):
    """Its second sample was one; its rate rises by 30 times the noise from each to the next."""
    noise = np.random.default_rng(9).standard_normal(samples)
    noise[place] += height
    sweep = 30.0 * samples / (2.0 * np.pi) * np.sin(2.0 * np.pi * np.arange(samples) / samples)
    found = find_spikes(sweep + noise, sample_rate=100.0).index
    assert found.tolist() == ([place % samples] if height else [])


@pytest.mark.parametrize("step", [0.0, 0.7])
def test_a_spike_lies_beyond_the_scatter_by_quartiles_and_by_the_inner_part(step):
    noise = np.random.default_rng(4).standard_normal(5003)
    noise = step * np.rint(noise / step) if step else noise
    limit = -1.15 * float(ndtri(0.5e-3 / noise.size))
    told = []
    for height in np.linspace(5.5, 9.0, 71):
        values = noise.copy()
        values[2000] = height
        around = np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, mode="reflect"), 5)
        off = values - np.median(np.delete(around, 2, axis=1), axis=1)
        low, high = np.quantile(off, [0.25, 0.75])
        inner = off[np.abs(off) <= np.quantile(np.abs(off), 0.95)]
        scatter = max((high - low) / 1.349, 1.3 * np.sqrt(np.mean(inner**2)))
        expected = abs(off[2000]) > limit * scatter
        assert (2000 in find_spikes(values, sample_rate=RATE).index) == expected
        told.append(expected)
    assert True in told
    assert False in told


def test_bursts_of_vibration_are_no_spikes_though_the_angle_keeps_few_of_their_samples():
    random = np.random.default_rng(8)
    noise = random.standard_normal(60_000)
    # Beside a motor: for a hundredth of a second in every second it shakes, forth and back.
    shaken = np.where(np.arange(noise.size) % 60 < 2, 25.0, 0.0) * random.standard_normal(
        noise.size
    )
    shaken -= np.roll(shaken, 1)
    found = find_spikes(noise + shaken, sample_rate=100.0)
    assert found.many
    assert found.index.size == 0
    # One in a thousand of them is what single samples are.
    single = np.where(random.random(noise.size) < 1e-3, 25.0, 0.0)
    found = find_spikes(noise + single, sample_rate=100.0)
    assert not found.many
    assert set(found.index) == set(np.flatnonzero(single))


def test_of_a_swing_that_dies_away_no_more_is_taken_than_chance_adds():
    """A swing of no net angle, in three hundred samples of noise: up to 189 deviations were."""
    taken = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        values, phases = random.standard_normal(60_000), np.arange(300) * random.uniform(0.1, 0.45)
        start = random.uniform(0.0, 2.0 * np.pi)
        values[30_000:30_300] += 12.0 * np.hanning(300) * np.sin(2.0 * np.pi * phases + start)
        taken.append(float(find_spikes(values, sample_rate=100.0).height.sum()))
    assert np.sqrt(np.mean(np.square(taken))) < 1.5 * np.sqrt(300.0)


def test_spikes_beside_one_another_are_spikes_with_either_sign():
    random = np.random.default_rng(6)
    values, spiked = random.standard_normal(200_000), np.arange(500, 199_500, 1000)
    spiked = np.concatenate([spiked, spiked + random.integers(5, 9, spiked.size)])
    values[spiked] += random.choice([-1.0, 1.0], spiked.size) * random.uniform(20.0, 60.0)
    found = set(find_spikes(values, sample_rate=100.0).index.tolist())
    assert len(found & set(spiked.tolist())) >= 0.97 * spiked.size
    assert found <= set(spiked.tolist())


@pytest.mark.parametrize(("seed", "begins"), [(4, 160.0), (7, 160.0), (4, 0.0)])
def test_a_line_that_begins_half_way_leaves_no_walk_where_it_begins(seed, begins):
    """What the line's fit leaves there were spikes: N read 3 and 8 times too high."""
    random, seconds = np.random.default_rng(seed), np.arange(60_000) / 200.0
    angle = np.cumsum(4e-4 / 60.0 / np.sqrt(200.0) * random.standard_normal(seconds.size))
    line = np.sin(2.0 * np.pi * random.uniform(30.0, 90.0) * seconds) * (seconds >= begins)
    read = np.floor((angle + 0.4 / 3600.0 * line) / (0.02 / 3600.0)) * (0.02 / 3600.0)
    still = sagnac.Recording.from_arrays(x=read, kind="angle", unit="deg", sample_rate=200.0)
    walk = sagnac.analyze(still).angle_random_walk.to("deg/sqrt(h)")
    assert walk.value == pytest.approx(4e-4, rel=0.1)
    assert walk.low < 4e-4 < walk.high


@pytest.mark.parametrize("turning", [False, True])
def test_a_heavy_tail_is_the_noises_on_a_bench_alone(turning):
    random, seconds = np.random.default_rng(5), np.arange(60_000) / 100.0
    phase = 2.0 * np.pi * seconds / 30.0
    # A drive that shakes where it runs fast; the same shaking at rest is noise of the gyro.
    shaking = np.cumsum(2e-5 * np.cos(phase) ** 8 * random.standard_normal(seconds.size))
    table = 0.5 * np.pi * np.sin(phase) + shaking
    own = np.cumsum(1e-7 * random.standard_normal(seconds.size))
    sensed = {"table": table, "table_unit": "rad"} if turning else {}
    recording = sagnac.Recording.from_arrays(
        x=own + (0.6 * table if turning else 0.6 * shaking),
        kind="angle",
        unit="rad",
        sample_rate=100.0,
        **sensed,
    )
    found = [one for one in sagnac.check(recording) if "heavy tail" in one.text]
    assert len(found) == (0 if turning else 1)


@pytest.mark.parametrize(("damaged", "status"), [(1e9, "estimated"), (1e30, "not observable")])
def test_a_sample_that_leaves_the_angle_no_digits_is_named(damaged, status):
    """It was called a readout in steps of 1e30, beside which all other samples are rounding."""
    rates = 0.01 * np.random.default_rng(3).standard_normal(20_000)
    rates[5000] = damaged
    still = sagnac.Recording.from_arrays(x=rates, kind="rate", unit="deg/s", sample_rate=50.0)
    analysis = sagnac.analyze(still)
    assert analysis.angle_random_walk.status == status
    (spikes,) = analysis.findings
    assert "1 sample" in spikes.text
    lost = "so far that the angle behind has no digits left for the noise"
    assert (lost in spikes.text) == (spikes.level == "error") == (status != "estimated")


@pytest.mark.parametrize(("freedoms", "said"), [(0, False), (1.5, True)])
def test_jitter_of_a_table_that_stands_still_now_and_then_is_no_tail_of_the_noise(freedoms, said):
    """Two thirds of its samples are without jitter; noise of Student's law has its own tail."""
    rng = np.random.default_rng(12)
    turns = np.repeat(np.arange(30) % 3 == 0, 2000)
    ramp = np.hanning(82)[1:-1] / 40.5
    rates = 40.0 * np.convolve(np.pad(turns, 40, mode="edge"), ramp, "same")[40:-40]
    rates += 0.003 * turns * rng.standard_normal(turns.size)
    angle = 3600.0 * np.cumsum(rates) / 100.0
    tail = rng.standard_t(freedoms, turns.size) if freedoms else np.zeros(turns.size)
    x = angle + np.cumsum(1e-3 * rng.standard_normal(turns.size) + 0.2 * tail)
    recording = sagnac.Recording.from_arrays(
        x=x, table=angle, kind="angle", unit="arcsec", sample_rate=100.0
    )
    told = [note for note in sagnac.check(recording) if "even noise" in note.text]
    assert bool(told) == said
