"""The table's angle from gyros and encoder, against the true one of a second simulator."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from sagnac.core import arrays
from sagnac.recording.channel import angle_of
from sagnac.rig.config import preset
from sagnac.rig.simulate import simulate as make_by_rig
from sagnac.table.estimate import EstimatedTable, estimated_table, order_drift, slow_tones, smoothed
from tests.second_rig import ARCSECOND, DEGREE, Bench, Simulated, simulate

RATE = 100.0
SECONDS = 900.0
MOTIONS = ("steady", "reversing", "dwelling", "swinging")
# The encoder's own error once and twice a turn, which nothing tells from the table's angle.
PERIODIC = np.hypot(0.8, 0.3) / np.sqrt(2.0) * ARCSECOND
# Orders above the fourth and tones of a gyro look like motion of the table: at the most.
SENSED = np.sqrt(0.5 * sum(size**2 for order, size in Bench().orders if order > 4.0))
SENSED = np.hypot(SENSED, np.sqrt(0.5 * sum(size**2 for _, size in Bench().tones)))
OWN = np.hypot(PERIODIC, SENSED / Bench().shares[2] * ARCSECOND)


def first_of(*seeds: float) -> list:
    """One draw in the default suite, the others in `make test-statistics`."""
    return [seeds[0], *(pytest.param(seed, marks=pytest.mark.statistics) for seed in seeds[1:])]


def bench(**settings) -> Bench:
    return Bench(**{"seconds": SECONDS, "sample_rate": RATE, **settings})


def estimated(recorded: Simulated, gyros: str = "xyz") -> EstimatedTable:
    angles = [recorded.angles[name] for name in gyros]
    return estimated_table(angles, recorded.table, recorded.sample_rate)


def error_of(angle: np.ndarray, recorded: Simulated) -> np.ndarray:
    """Of an angle, except for a straight line, rad."""
    error = angle - recorded.true_table
    place = np.linspace(-1.0, 1.0, error.size)
    return error - np.polyval(np.polyfit(place, error, 1), place)


@pytest.mark.parametrize("gyros", ["x", "xz", "xyz"])
@pytest.mark.parametrize("jitter", [0.0, *first_of(500e-6, 20e-6, 100e-6)])
def test_jitter_of_the_latch_leaves_the_angle(jitter, gyros):
    recorded = simulate(bench(jitter=jitter))
    found = estimated(recorded, gyros)
    read = error_of(recorded.table, recorded)
    # White noise of readings below a corner fc has 2 fc / sample rate of its variance; the filter
    # goes over the readings twice, and its noise band is nearly that.
    scatter = jitter * 40.0 * DEGREE
    left = scatter * np.sqrt(2.0 * min(found.corner, 0.5 * RATE) / RATE)
    assert np.std(read) == pytest.approx(np.hypot(PERIODIC, scatter), rel=0.05)
    assert np.std(error_of(found.angle, recorded)) < OWN + 3.0 * left
    # From sample to sample it is as smooth as the gyros' motion.
    steps = np.diff(error_of(found.angle, recorded))
    assert np.std(steps) < 0.06 * ARCSECOND
    if jitter > 0.0:
        assert found.smoothed
        assert found.noise == pytest.approx(scatter, rel=0.03)


@pytest.mark.parametrize("jitter", first_of(100e-6, 0.0))
@pytest.mark.parametrize("motion", MOTIONS)
def test_the_angle_follows_tables_that_stop_turn_back_and_swing(motion, jitter):
    recorded = simulate(bench(motion=motion, jitter=jitter))
    found = estimated(recorded)
    # Jitter of 100 us is up to 14 arcsec; a hundredth of a hertz holds 1/70 of it.
    assert np.std(error_of(found.angle, recorded)) < OWN + 1.0 * ARCSECOND


def test_what_a_gyro_hums_is_no_motion_while_the_table_stands():
    recorded = simulate(bench(motion="dwelling", hunting=0.0, readout=0.0))
    hum = 1e-6 * np.cos(2.0 * np.pi * 23.0 * np.arange(recorded.table.size) / RATE)
    angles = dict(recorded.angles, x=recorded.angles["x"] + hum)
    found = estimated(replace(recorded, angles=angles), "xz")
    assert found.smoothed
    speed = np.abs(np.diff(recorded.true_table)) * RATE
    # A second from where it turns.
    stands = np.convolve(speed > 1e-3 * speed.max(), np.ones(201), mode="same") == 0.0
    steps = np.diff(found.angle - recorded.true_table)
    assert stands.mean() > 0.3
    assert np.std(steps[stands]) < 0.1 * np.std(np.diff(hum)) / 2.0 / 0.577


@pytest.mark.parametrize("cycles", first_of(27.0, 14.3, 41.5))
def test_slow_tones_of_gyros_are_not_in_the_angle(cycles):
    # Above the corner the angle is the gyros'. Each tone there makes two products with every order.
    recorded = simulate(bench(jitter=20e-6))
    phase = 2.0 * np.pi * np.arange(recorded.table.size) / recorded.table.size
    tones = ARCSECOND * (np.cos(cycles * phase + 0.4) + 3.0 * np.cos((cycles - 3.6) * phase))
    found, without = (
        estimated(replace(recorded, angles=dict(recorded.angles, x=angle)), "xz")
        for angle in (recorded.angles["x"] + tones, recorded.angles["x"])
    )
    assert found.smoothed
    left = error_of(found.angle, recorded) - error_of(without.angle, recorded)
    # Readings tell amplitudes and phases of two tones, and their changes, under a window.
    scatter = 20e-6 * 40.0 * DEGREE * np.sqrt(8.0 * 1.5 / left.size)
    assert np.std(left) < 3.0 * scatter
    # Half of the tones is in the mean of both gyros.
    assert 3.0 * scatter < 0.1 * np.std(0.5 * tones)


@pytest.mark.parametrize("tone", [0.0, 10.0])
@pytest.mark.parametrize("seed", first_of(1, 2, 3, 4))
@pytest.mark.parametrize("motion", ["speeds up", "steps"])
def test_the_angle_keeps_to_the_readings_of_a_table_whose_rate_changes(motion, seed, tone):
    random, time = np.random.default_rng(seed), np.arange(40_000) / RATE
    levels = {"speeds up": np.linspace(66.0, 82.0, time.size)}
    levels["steps"] = np.interp(time, [98.0, 102.0, 298.0, 302.0], [37.0, 89.0, 89.0, 50.0])
    # A servo that hardly wanders does not tell a share from drift and delay on such a table.
    rate = levels[motion] + 0.001 * random.standard_normal(time.size)
    true = np.cumsum(rate) * DEGREE / RATE
    noise = 2.0 * ARCSECOND * random.standard_normal(time.size)
    hum = tone * ARCSECOND * np.cos(2.0 * np.pi * 27.0 * time / time[-1])
    gyros = [
        share * true + np.cumsum(1e-9 * random.standard_normal(time.size)) + share * hum
        for share in (0.577, 0.578)
    ]
    found = estimated_table(gyros, true + noise, RATE)
    assert found.smoothed
    error = found.angle - true
    # The tone is the gyros' own, and all but its part that readings do not tell is out; at both
    # ends of the record, too.
    left = np.sqrt(np.mean((error - error.mean()) ** 2))
    assert left < 1.0 * ARCSECOND
    assert np.abs(error - error.mean()).max() < 5.0 * ARCSECOND


def test_no_tone_is_found_in_noise_of_readings_that_walk():
    random = np.random.default_rng(4)
    for _ in range(20):
        walk = np.cumsum(random.standard_normal(20_000)) + 30.0 * random.standard_normal(20_000)
        assert not slow_tones(walk, 900.0, 1.0, (0.0, 400.0)).any()


def test_steps_of_the_encoder_leave_the_angle():
    step = 36.0 * ARCSECOND
    recorded = simulate(bench(step=36.0))
    found = estimated(recorded)
    assert found.smoothed
    # 40 deg/s moves the table by 40 steps a sample to 1e-4: readings lie within one step.
    assert np.std(error_of(recorded.table, recorded)) == pytest.approx(
        np.hypot(step / np.sqrt(12.0), PERIODIC), rel=0.05
    )
    assert np.std(error_of(found.angle, recorded)) < 0.2 * step / np.sqrt(12.0)


def test_a_wander_slower_than_the_gyros_know_stays_in_the_angle():
    # 100 us that walk are 14 arcsec, which at a steady rate only the encoder says; above the
    # corner the walk's own steps are beneath the gyros'.
    recorded = simulate(bench(latency_walk=100e-6))
    found = estimated(recorded)
    gain = np.std(np.diff(error_of(found.angle, recorded)))
    assert gain < np.std(np.diff(error_of(found.readings, recorded)))
    assert np.std(error_of(found.angle, recorded)) < 1.05 * np.std(
        error_of(recorded.table, recorded)
    )


def test_gyros_that_know_less_leave_the_readings_as_they_are():
    recorded = simulate(bench(walks=(1.0, 1.0, 1.0)))
    found = estimated(recorded)
    assert found.angle is recorded.table
    assert found.corner == np.inf
    assert not found.smoothed
    assert found.delay is None


@pytest.mark.parametrize("motion", ["reversing", "dwelling"])
@pytest.mark.parametrize(
    ("settings", "mean", "change"),
    [
        ({"latency": 2e-3}, 2e-3, 0.0),
        ({"clock": 20e-6}, 0.5 * 20e-6 * SECONDS, 20e-6 * SECONDS),
        ({"latency_drift": 5e-3}, 2.5e-3, 5e-3),
        ({"latency": -2e-3, "jitter": 100e-6}, -2e-3, 0.0),
    ],
    ids=["late", "clock", "drift", "early with jitter"],
)
def test_a_delay_is_found_within_its_errors(motion, settings, mean, change):
    delay = estimated(simulate(bench(motion=motion, **settings))).delay
    assert delay is not None
    assert abs(delay.mean - mean) < min(5.0 * delay.mean_error, 20e-6)
    assert abs(delay.change - change) < min(5.0 * delay.change_error, 40e-6)
    middle = delay.at(np.array([0.5 * SECONDS]))
    assert middle == pytest.approx([delay.mean], abs=1e-12)


@pytest.mark.parametrize("seed", first_of(1, 2, 3))
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("jitter", first_of(100e-6, 0.0))
def test_no_delay_is_named_if_there_is_none(motion, seed, jitter):
    assert estimated(simulate(bench(motion=motion, seed=seed, jitter=jitter))).delay is None


def test_a_delay_far_below_a_sample_and_a_latch_is_not_named():
    """Half a microsecond of a quiet encoder is seventy standard errors, and nothing."""
    quiet = {"motion": "reversing", "step": 0.02, "hunting": 5e-4, "periodic": ()}
    assert estimated(simulate(bench(latency=5e-7, **quiet))).delay is None
    delay = estimated(simulate(bench(latency=2e-5, **quiet))).delay
    assert delay is not None
    assert delay.mean == pytest.approx(2e-5, rel=0.01)


def test_a_delay_that_is_found_is_taken_out_of_the_readings():
    found = estimated(recorded := simulate(bench(motion="reversing", clock=20e-6)))
    inner = slice(100, -100)
    late = error_of(recorded.table, recorded)[inner]
    left = error_of(found.readings, recorded)[inner]
    assert np.std(late) > 500.0 * ARCSECOND
    assert np.std(left) < 2.0 * ARCSECOND


@pytest.mark.parametrize("span", [5000, 1234])
def test_the_estimate_is_the_same_by_blocks_of_any_length(monkeypatch, span):
    recorded = simulate(bench(seconds=300.0, motion="reversing", latency=2e-3, jitter=20e-6))
    whole = estimated(recorded, "xz")
    monkeypatch.setattr(arrays, "BLOCK", span)
    parts = estimated(recorded, "xz")
    assert np.asarray(parts.angle) == pytest.approx(np.asarray(whole.angle), abs=1e-9)
    assert np.asarray(parts.readings) == pytest.approx(np.asarray(whole.readings), abs=1e-9)
    assert parts.shares == pytest.approx(whole.shares, rel=1e-12)
    assert parts.noise == pytest.approx(whole.noise, rel=1e-9)


@pytest.mark.parametrize(
    ("rate", "seconds"), [(10.0, 1800.0), (40.0, SECONDS), (80.0, SECONDS)], ids=["10", "40", "80"]
)
def test_a_delay_that_drifts_is_read_off_the_orders(rate, seconds):
    drift = 5e-3 * rate * DEGREE
    recorded = simulate(bench(rate=rate, seconds=seconds, latency_drift=5e-3))
    table, pair = estimated(recorded), without_table(recorded)
    found = order_drift(table, pair, RATE, share=0.0)
    # A servo that hunts may have given a part of it away already.
    known = 0.0 if table.delay is None else table.delay.change * rate * DEGREE
    uncertain = 0.0 if table.delay is None else table.delay.change_error * rate * DEGREE
    value, error = (0.0, np.inf) if found is None else (found.value, found.error)
    if table.delay is None:
        assert found is not None
    assert abs(known + value - drift) < 4.0 * min(error, uncertain or np.inf)
    assert abs(known + value - drift) < 0.1 * drift
    if found is not None:
        # And the table led by it keeps the orders' phases.
        assert order_drift(table.with_drift(found), pair, RATE, share=0.0) is None


@pytest.mark.parametrize("seed", first_of(1, 2, 3))
@pytest.mark.parametrize("rate", [20.0, 40.0, 80.0])
def test_no_drift_is_read_off_orders_that_keep_their_phases(rate, seed):
    recorded = simulate(bench(rate=rate, seed=seed, jitter=20e-6))
    found = order_drift(estimated(recorded), without_table(recorded), RATE, share=0.0)
    assert found is None


@pytest.mark.parametrize("seed", first_of(1, 2, 3))
def test_no_drift_is_read_off_the_motion_of_a_table_that_dwells(seed):
    # One gyro holds the table's starts and stops, beside which its orders are nothing.
    recorded = simulate(bench(motion="dwelling", cycle=30.0, seed=seed, jitter=20e-6))
    table = estimated(recorded, "x")
    share = float(table.shares[0])
    angle = recorded.angles["x"] - share * (table.readings - table.angle)
    assert order_drift(table, angle, RATE, share=share) is None


def without_table(recorded: Simulated) -> np.ndarray:
    """(samples,) x and z weighted by each other's true share, rad."""
    of_x, _, of_z = Bench().shares
    return of_z * recorded.angles["x"] - of_x * recorded.angles["z"]


@pytest.mark.parametrize("seed", first_of(41, 42))
def test_no_delay_is_named_for_a_ripple_that_stands_between_two_groups_of_frequencies(seed):
    # The rig: order 12 is 1.3333 Hz; of 18,000 averages a group ends at 1.3329 Hz.
    base = preset("paper")
    encoder = replace(base.encoder, latch_jitter_s=0.0)
    config = replace(base, duration_s=1800.0, sample_rate_hz=200.0, seed=seed, encoder=encoder)
    recording = make_by_rig(config).recording
    angles = [angle_of(recording.gyro(name), 200.0) for name in "xz"]
    assert estimated_table(angles, recording.table.values, 200.0).delay is None


@pytest.mark.parametrize("seed", first_of(2, 3))
def test_no_drift_is_read_off_a_table_that_stands_for_good(seed):
    """It turns at 40 deg/s for the first half; in the other nothing goes with its angle."""
    random, time = np.random.default_rng(seed), np.arange(round(SECONDS * RATE)) / RATE
    rate = 40.0 * DEGREE * np.clip((0.5 * SECONDS - time) / 3.0, 0.0, 1.0)
    table = np.cumsum(rate) / RATE + 12.3 * DEGREE
    table = table + 0.01 * DEGREE * np.cumsum((rate > 0.0) * np.cos(12.0 * table)) / RATE
    sizes = {1: 2.0, 2: 0.8, 3: 0.3, 4: 0.5, 6: 0.1, 12: 0.2, 36: 0.05}
    gyros = []
    for share, phase in ((0.577, 0.0), (0.575, 2.1)):
        angle = share * table + np.cumsum(5e-5 * np.cos(table - phase)) / RATE + 2e-5 * time
        angle += np.cumsum(random.standard_normal(time.size)) * 1e-4 * DEGREE / 60.0 / 10.0
        for order, size in sizes.items():
            own = size * ARCSECOND * (0.5 + random.random())
            angle += own * np.cos(order * table + 2.0 * np.pi * random.random())
        for frequency, size in ((7.13, 0.02), (0.83, 0.05), (31.7, 0.004)):
            turned = 2.0 * np.pi * (frequency * time + random.random())
            angle += size * ARCSECOND * np.cos(turned)
        gyros.append(angle)
    read = table + 1e-5 * DEGREE * random.standard_normal(time.size)
    found = estimated_table(gyros, read, RATE)
    weights = np.sqrt(2.0) * found.shares[::-1] / np.hypot(*found.shares)
    pair = weights[0] * gyros[0] - weights[1] * gyros[1]
    assert order_drift(found, pair, RATE, share=0.0) is None


@pytest.mark.parametrize("corner", [0.004, 0.03, 0.7])
def test_smoothed_is_a_butterworth_filter_there_and_back(corner):
    """Beside that of scipy, which runs over a long odd extension."""
    values = 3.0 + np.cumsum(np.random.default_rng(5).standard_normal(2000))
    sections = butter(2, min(2.0 * corner, 0.99), output="sos")
    expected = sosfiltfilt(sections, values, padtype="odd", padlen=1990)
    assert smoothed(values, corner) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("seed", first_of(1, 2, 3, 4))
def test_orders_that_no_column_holds_are_no_delay(seed):
    """Large ones look like a change of the delay, the same however much is taken out."""
    random = np.random.default_rng(seed)
    time = np.arange(round(SECONDS * RATE)) / RATE
    rate = 20.0 * DEGREE * (1.0 + 1e-4 * np.sin(2.0 * np.pi * 0.013 * time))
    table = np.cumsum(rate) / RATE
    orders = sum(
        60.0 * ARCSECOND / order * np.sin(order * table + random.uniform(0.0, 6.0))
        for order in (1, 2, 3, 5, 7, 12)
    )
    gyro = table + 11.0 * ARCSECOND * time + orders
    gyro += np.cumsum(1e-8 * random.standard_normal(time.size))
    encoder = table + rate * 1e-5 * random.standard_normal(time.size)
    assert estimated_table([gyro], encoder, RATE).delay is None


@pytest.mark.parametrize("seed", first_of(1, 2))
@pytest.mark.parametrize(
    ("motion", "size"), [("reversing", 60.0), ("dwelling", 60.0), ("swinging", 5.0)]
)
def test_a_delay_is_found_beside_large_orders(motion, size, seed):
    orders = tuple((order, size / order) for order in (1.0, 2.0, 3.0, 5.0, 7.0, 12.0))
    settings = {"motion": motion, "latency": 2e-3, "seed": seed, "orders": orders}
    delay = estimated(simulate(bench(**settings))).delay
    assert delay is not None
    assert abs(delay.mean - 2e-3) < 4.0 * delay.mean_error
    assert abs(delay.change) < 4.0 * delay.change_error
    assert delay.mean_error < 1e-4


@pytest.mark.parametrize("seed", first_of(1, 2))
@pytest.mark.parametrize("late", [0.0, 2e-3])
def test_what_gyros_show_at_the_order_of_a_ripple_is_no_delay_of_a_table_that_sweeps(late, seed):
    """Written out: 1 to 100 deg/s and back in 300 s, a motor of 12 poles, gyros with order 12."""
    random = np.random.default_rng(seed)
    time = np.arange(round(SECONDS * RATE)) / RATE

    def table_at(when: np.ndarray) -> np.ndarray:
        up, down = np.clip(when % 300.0, 0.0, 150.0), np.clip(when % 300.0 - 150.0, 0.0, 150.0)
        even = 15_150.0 * (when // 300.0) + up + 0.33 * up**2 + 100.0 * down - 0.33 * down**2
        even *= DEGREE
        return even + 2e-4 / 12.0 * np.sin(12.0 * even)

    table = table_at(time)
    gyros = [
        share * table
        + 0.3 * ARCSECOND * np.cos(12.0 * table + phase)
        + np.cumsum(6e-9 * random.standard_normal(time.size))
        for share, phase in ((0.577, 2.0), (0.5765, 3.0))
    ]
    encoder = table_at(time + late) + 0.05 * ARCSECOND * random.standard_normal(time.size)
    found = estimated_table(gyros, encoder, RATE)
    if late:
        assert found.delay is not None
        assert found.delay.mean == pytest.approx(-late, abs=min(5e-6, 5.0 * found.delay.mean_error))
    else:
        assert found.delay is None


@pytest.mark.parametrize("seed", first_of(2, 3))
def test_no_drift_is_read_off_earth_rate_beside_an_order_1_of_a_table_that_speeds_up(seed):
    random, time = np.random.default_rng(seed), np.arange(round(900.0 * RATE)) / RATE
    table = np.cumsum(np.linspace(7.5, 22.5, time.size)) * DEGREE / RATE
    gyros = []
    for share, phase in ((0.577, 0.0), (0.575, 2.1)):
        # Earth rate makes an order whose size goes with the time of a turn.
        angle = share * table + np.cumsum(5e-5 * np.cos(table - phase)) / RATE
        angle += np.cumsum(random.standard_normal(time.size)) * 2e-3 * DEGREE / 60.0 / np.sqrt(RATE)
        for order, size in ((1, 2.0), (3, 0.5)):
            angle += size * ARCSECOND * np.cos(order * table + 2.0 * np.pi * random.random())
        gyros.append(angle)
    found = estimated_table(gyros, table + ARCSECOND * random.standard_normal(time.size), RATE)
    pair = found.shares[1] * gyros[0] - found.shares[0] * gyros[1]
    assert order_drift(found, pair, RATE, share=0.0) is None


def test_a_hum_of_the_gyros_is_not_in_the_angle_that_they_lead():
    """Its product with the same hum in the gyros would stand still, and look like orders."""
    random, time = np.random.default_rng(7), np.arange(60_000) / 500.0
    table, waves = 20.0 * DEGREE * time, np.exp(2j * np.pi * 190.0 * time)
    gyros = [share * table + ARCSECOND * waves.real for share in (0.577, 0.575)]
    gyros = [one + 1e-8 * np.cumsum(random.standard_normal(time.size)) for one in gyros]
    found = estimated_table(
        gyros, table + 5.0 * ARCSECOND * random.standard_normal(time.size), 500.0
    )
    assert found.smoothed
    # The table would show 1 arcsec over 0.577.
    assert abs(np.mean((found.angle - table) * waves)) < 0.01 * ARCSECOND


@pytest.mark.parametrize("motion", ["steady", "sweeps", "stops"])
def test_a_servo_that_hunts_moves_the_table_and_stays_in_the_angle(motion):
    """0.03 deg/s/sqrt(Hz) up to 20 Hz was taken for a hum, and 4 arcsec of motion smoothed away."""
    random, time = np.random.default_rng(7), np.arange(60_000) / 200.0
    levels = {
        "steady": np.full(time.size, 45.0),
        "sweeps": 45.0 * np.sin(2.0 * np.pi * time / 40.0),
        "stops": np.where(time % 35.0 < 25.0, 45.0, 0.0),
    }
    hunts = 0.03 * np.sqrt(200.0 / 2.0) * random.standard_normal(time.size)
    hunts = sosfiltfilt(butter(2, 20.0, fs=200.0, output="sos"), hunts)
    table = np.cumsum(levels[motion] + hunts) / 200.0 * DEGREE
    walks = np.cumsum(random.standard_normal((2, time.size)), axis=1) * 1e-3 / 60.0 / 200.0**0.5
    gyros = np.outer((0.577, 0.575), table) + DEGREE * walks
    noise = 3.0 * ARCSECOND * random.standard_normal(time.size)
    found = estimated_table(list(gyros), table + noise, 200.0)
    assert found.smoothed
    # From sample to sample the gyros add 0.02 arcsec, a straight line leaves 1.
    moved = np.std(np.diff(table - sosfiltfilt(butter(2, 1.0, fs=200.0, output="sos"), table)))
    assert moved > 0.8 * ARCSECOND
    assert np.std(np.diff(found.angle - table)) < 0.05 * ARCSECOND


@pytest.mark.parametrize("seed", first_of(5, 6, 7, 8))
def test_a_delay_is_found_beside_a_ripple_that_is_far_larger_than_what_tells_it(seed):
    """The rates at both ends did not follow the ripple: a half was read, and not named."""
    rate, late = 200.0, 3e-3
    random, time = np.random.default_rng(seed), np.arange(240_000) / rate
    tones = random.uniform(0.01, 0.6, 100), random.uniform(0.0, 2.0 * np.pi, 100)

    def turned(seconds: np.ndarray) -> np.ndarray:
        """deg; the rate strays by 4.5e-3 deg/s rms, and by 0.2 deg/s in twelve cycles a turn."""
        angle = 45.0 * seconds
        for frequency, phase in zip(*tones, strict=True):
            swing = 2.0 * np.pi * frequency
            angle += 6.4e-4 / swing * np.sin(swing * seconds + phase)
        return angle + 0.02 * np.sin(np.radians(12.0 * angle))

    angle = turned(time)
    walks = np.cumsum(random.standard_normal((2, time.size)), axis=1) * 1e-3 / 60.0 / rate**0.5
    gyros = np.array([[0.577], [0.579]]) * angle + walks
    encoder = turned(time - late) + 0.05 / 3600.0 * random.standard_normal(time.size)
    table = estimated_table(list(gyros * DEGREE), encoder * DEGREE, rate)
    assert table.delay is not None
    assert abs(table.delay.mean - late) < 4.0 * table.delay.mean_error < 5e-4
