"""Lines found, and only those: against what was put in, by means that are not the package's."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from sagnac.lines import search
from sagnac.lines.detection import detection_threshold
from sagnac.lines.search import remove_lines
from sagnac.recording.model import Recording
from sagnac.rig.config import preset
from sagnac.rig.sections import DisturbancesConfig
from sagnac.rig.simulate import simulate

TURN = 2.0 * np.pi
RATE = 100.0
WALK = 7e-9  # angle random walk, rad/sqrt(s)
SIGMA = WALK / np.sqrt(RATE)  # of an increment at 100 Hz


def walk(samples, seed):
    return SIGMA * np.cumsum(np.random.default_rng(seed).standard_normal(samples))


def tone(samples, frequency, amplitude, phase=0.4):
    return amplitude * np.cos(TURN * frequency / RATE * np.arange(samples) + phase)


def wandering_table(samples, wander=0.02):
    t = np.arange(samples) / RATE
    rate = np.radians(40.0) * (1.0 + wander * (np.sin(t / 23.0) + 0.67 * np.cos(t / 7.0)))
    return 0.3 + np.cumsum(rate) / RATE


def found_at(lines, scale, frequency, within):
    [line] = [
        line for line in lines if line.scale == scale and abs(line.frequency - frequency) < within
    ]
    return line


# --- lines in time ---------------------------------------------------------------------------


@pytest.mark.parametrize("seeds", [20, pytest.param(60, marks=pytest.mark.statistics)])
def test_tones_are_found_within_their_stated_errors(seeds):
    samples = 6000
    resolution = RATE / samples
    # On a bin, between two, low, and near Nyquist; some 15 dB above what is seen at all.
    truth = [(120 * resolution, 3e-9), (7.30771, 3e-10), (0.2351, 3e-8), (49.113, 8e-11)]
    ratios = []
    for seed in range(seeds):
        angle = walk(samples, seed)
        for index, (frequency, amplitude) in enumerate(truth):
            angle = angle + tone(samples, frequency, amplitude, 0.7 * index)
        lines = remove_lines(angle, None, RATE, channel="x").lines
        assert len(lines) == len(truth)
        for index, (frequency, amplitude) in enumerate(truth):
            line = found_at(lines, "time", frequency, 0.3 * resolution)
            phase = np.angle(np.exp(1j * (line.phase - 0.7 * index)))
            ratios.append(
                [
                    (line.frequency - frequency) / line.frequency_error,
                    (line.amplitude - amplitude) / line.amplitude_error,
                    phase / line.phase_error,
                ]
            )
    ratios = np.array(ratios)
    # Of 240 errors over their stated deviations an rms is good to 4.6 %, a mean to 0.065. The floor
    # under each line is itself only known to 6 % of power.
    fewer = np.sqrt(60.0 / seeds)
    assert np.sqrt(np.mean(ratios**2, axis=0)) == pytest.approx(np.ones(3), abs=0.16 * fewer)
    assert np.mean(ratios, axis=0) == pytest.approx(np.zeros(3), abs=0.25 * fewer)


def test_what_is_left_is_the_noise():
    samples = 20_000
    noise = walk(samples, 3)
    angle = noise + tone(samples, 7.3033, 1e-6) + tone(samples, 31.0071, 3e-7)
    removal = remove_lines(angle, None, RATE, channel="x")
    assert len(removal.lines) == 2
    # Six parameters fitted take six of 20 000 degrees of freedom, and nothing more.
    difference = np.diff(removal.residual - noise)
    assert np.sum(difference**2) < 25.0 * SIGMA**2
    for line in removal.lines:
        assert any(low < line.frequency < high for low, high in removal.masked)
    assert all(high - low < 10 * RATE / samples for low, high in removal.masked)


def test_two_close_tones_are_two():
    samples = 10_000
    apart = 2.0 * RATE / samples
    angle = walk(samples, 1) + tone(samples, 5.0, 5e-9) + tone(samples, 5.0 + apart, 5e-10, 2.0)
    lines = remove_lines(angle, None, RATE, channel="x").lines
    assert len(lines) == 2
    strong = found_at(lines, "time", 5.0, 0.3 * apart)
    weak = found_at(lines, "time", 5.0 + apart, 0.3 * apart)
    assert strong.amplitude == pytest.approx(5e-9, abs=5.0 * strong.amplitude_error)
    assert weak.amplitude == pytest.approx(5e-10, abs=5.0 * weak.amplitude_error)
    assert lines == (strong, weak)
    assert strong.significance > weak.significance


def test_a_weak_line_beside_one_a_million_times_stronger_in_power():
    samples = 20_000
    angle = walk(samples, 2) + tone(samples, 10.00123, 1e-6) + tone(samples, 11.7, 1e-9)
    lines = remove_lines(angle, None, RATE, channel="x").lines
    assert len(lines) == 2
    assert found_at(lines, "time", 11.7, 1e-3).amplitude == pytest.approx(1e-9, rel=0.05)


def noise_steps(kind, samples, generator):
    white = generator.standard_normal(samples)
    if kind == "random walk":
        return white
    if kind == "quantization":
        return 0.3 * white + 3.0 * np.diff(generator.standard_normal(samples + 1))
    return white + 0.02 * np.cumsum(generator.standard_normal(samples))


@pytest.mark.parametrize("seeds", [8, pytest.param(20, marks=pytest.mark.statistics)])
@pytest.mark.parametrize("kind", ["random walk", "quantization", "random walk of rate"])
def test_noise_alone_has_no_lines(kind, seeds):
    alarms = sum(
        bool(
            remove_lines(
                SIGMA * np.cumsum(noise_steps(kind, 8192, np.random.default_rng([seed, 5]))),
                None,
                RATE,
                channel="x",
            ).lines
        )
        for seed in range(seeds)
    )
    # One in a hundred by default: two or more of twenty is 1.7 in a hundred runs.
    assert alarms <= seeds // 20


def test_lines_that_do_not_stand_in_the_end_leave_an_answer_behind():
    # At a threshold this loose noise has candidates all the time, and some records lose them all
    # again when they are fitted together.
    counts = [
        len(remove_lines(walk(1000, [seed, 6]), None, RATE, channel="x", false_alarm=0.99).lines)
        for seed in range(60)
    ]
    assert 0 in counts
    assert max(counts) > 0


@pytest.mark.parametrize("samples", [60, 99, 150, 400])
def test_a_short_record_of_a_turning_table_has_an_answer(samples):
    table = TURN * 0.05 * np.arange(samples) * (1.0 + 0.1 * np.sin(np.arange(samples) / 9.0))
    angle = walk(samples, 17) + 0.3 * table + tone(samples, 31.0, 1e-6)
    removal = remove_lines(angle, table, 10.0, channel="x")
    assert removal.residual.shape == (samples,)
    assert np.all(np.isfinite(removal.residual))


def test_a_false_alarm_of_nothing_is_refused():
    with pytest.raises(ValueError, match=r"false_alarm is 0\.0; give a number between 0 and 1"):
        remove_lines(walk(1000, 0), None, RATE, channel="x", false_alarm=0.0)


def test_arguments_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r"table has shape \(9,\); give \(20,\)"):
        remove_lines(np.zeros(20), np.zeros(9), RATE, channel="x")
    with pytest.raises(ValueError, match=r"sample_rate is 0\.0; give samples per second"):
        remove_lines(np.zeros(20), None, 0.0, channel="x")
    with pytest.raises(ValueError, match=r"angle has shape \(15,\); give 16 samples or more"):
        remove_lines(np.zeros(15), None, RATE, channel="x")
    with pytest.raises(ValueError, match="angle is 0 throughout"):
        remove_lines(np.zeros(20), None, RATE, channel="x")
    with pytest.raises(ValueError, match="channel is None; give the channel a name"):
        remove_lines(walk(1000, 0), None, RATE, channel=None)


@pytest.mark.parametrize("argument", ["angle", "table"])
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda whole: np.where(np.arange(whole.size) == 7, np.nan, whole), ": sample 7 is nan"),
        (lambda whole: np.ma.masked_inside(whole, whole[7], whole[7]), ": sample 7 is nan"),
        (lambda whole: whole + 0j, " holds complex128 values"),
        (lambda whole: whole.astype(str), " holds <U32 values"),
        (lambda whole: whole > 0.0, " holds bool values"),
        (
            lambda whole: Recording.from_arrays(x=whole, kind="angle", unit="rad", sample_rate=1.0),
            " is Recording.*give 'x', whose values are an array",
        ),
    ],
    ids=["NaN", "masked", "complex", "texts", "booleans", "recording"],
)
def test_what_is_no_whole_column_of_numbers_is_refused(argument, change, said):
    whole = {"angle": walk(1000, 0), "table": np.arange(1000.0)}
    whole[argument] = change(whole[argument])
    with pytest.raises(ValueError, match=f"^{argument}{said}"):
        remove_lines(**whole, sample_rate=RATE, channel="x")


@pytest.mark.parametrize(
    ("angle", "said"),
    [
        (1e-3 * np.arange(1000.0), "a straight line, to rounding"),
        (np.arange(1000), "a straight line, to rounding"),
        (1e-300 * walk(1000, 0), "give it in rad"),
        (1e300 * walk(1000, 0), "give it in rad"),
    ],
)
def test_an_angle_without_noise_that_can_be_squared_is_refused(angle, said):
    with pytest.raises(ValueError, match=f"^angle .*{said}"):
        remove_lines(angle, None, RATE, channel="x")


@pytest.mark.filterwarnings("error")
def test_less_than_two_averages_beside_a_table_are_refused():
    table = 1e-3 * np.arange(30.0)
    with pytest.raises(ValueError, match=r"angle has 18 samples at 100 Hz; .* give 0\.2 s or more"):
        remove_lines(walk(18, 0), table[:18], 100.0, channel="x")
    assert remove_lines(walk(30, 0), table, 100.0, channel="x").residual.shape == (30,)


def many_tones(samples):
    generator = np.random.default_rng(3)
    angle = walk(samples, 5)
    for frequency in np.linspace(2.0, 48.0, 300):
        place = frequency + generator.uniform(0.0, 0.1)
        angle = angle + tone(samples, place, 1e-7, generator.uniform(0.0, 6.0))
    return angle


def test_hundreds_of_tones_are_bands_of_vibration():
    removal = remove_lines(many_tones(20_000), None, RATE, channel="x")
    assert removal.unfinished is None
    assert [note.level for note in removal.notes if "vibration at" in note.text] == ["warning"]
    covered = sum(high - low for low, high in removal.masked if high - low > 1.0)
    assert covered > 25.0


def test_a_search_without_end_says_so_and_leaves_the_lines_beside(monkeypatch):
    monkeypatch.setattr(search, "crowded_bands", lambda *_: ())
    angle = many_tones(20_000)
    removal = remove_lines(angle, None, RATE, channel="x")
    [note] = removal.notes
    assert note.level == "warning"
    assert note.text == f"the search stopped at {len(removal.lines)} lines; " + (
        "more peaks stand above the floor"
    )
    assert np.array_equal(removal.unfinished, angle)


def test_nothing_is_searched_below_four_cycles_a_record():
    samples = 8000
    angle = walk(samples, 4) + tone(samples, 2.0 * RATE / samples, 1e-5)
    assert not any(
        line.frequency < 2.9 * RATE / samples
        for line in remove_lines(angle, None, RATE, channel="x").lines
    )


def test_lines_scale_with_the_angle():
    angle = walk(8000, 6) + tone(8000, 3.3, 1e-8)
    [small] = remove_lines(angle, None, RATE, channel="x").lines
    [large] = remove_lines(1e6 * angle, None, RATE, channel="x").lines
    assert large.amplitude == pytest.approx(1e6 * small.amplitude, rel=1e-9)
    assert large.frequency == pytest.approx(small.frequency, rel=1e-12)
    assert large.significance == pytest.approx(small.significance, rel=1e-6)
    assert small.channel == "x"


def test_progress_goes_up_to_one():
    seen = []
    remove_lines(walk(2000, 0), None, RATE, channel="x", progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_a_line_that_drifts_is_fitted_in_blocks_and_said_so():
    samples = 40_000
    noise = walk(samples, 15)
    number = np.arange(samples)
    swing = 1.0 + 0.3 * np.cos(4.0 * (number / samples) ** 2)
    angle = noise + tone(samples, 20.0, 1e-7) * swing + tone(samples, 20.8, 1e-8)
    removal = remove_lines(angle, None, RATE, channel="x")
    drifting = found_at(removal.lines, "time", 20.0, 1e-3)
    assert drifting.name.startswith("drifts: fitted in ")
    assert drifting.amplitude == pytest.approx(1e-7 * np.sqrt(np.mean(swing**2)), rel=0.01)
    steady = found_at(removal.lines, "time", 20.8, 1e-3)
    assert steady.amplitude == pytest.approx(1e-8, abs=5.0 * steady.amplitude_error)
    assert len(removal.lines) == 2
    [note] = removal.notes
    assert note.channel == "x"
    assert note.level == "remark"
    assert note.text.startswith("the line at 20 Hz drifts, by 2")
    # The note says how much noise was taken, as a bandwidth of its density.
    left = np.diff(removal.residual)
    lost = np.sum(np.diff(noise) ** 2) - np.sum(left**2)
    said = np.sum(removal.taken[1]) * 2.0 * samples / RATE * SIGMA**2
    assert lost == pytest.approx(said, abs=4.0 * SIGMA**2 * np.sqrt(2.0 * said / SIGMA**2))


def test_a_line_whose_phase_alone_drifts_is_said_to():
    samples = 40_000
    number = np.arange(samples)
    turns = 20.0 * number / RATE + 0.2 * np.cos(3.0 * (number / samples) ** 2)
    angle = walk(samples, 16) + 1e-7 * np.cos(2.0 * np.pi * turns)
    [note] = remove_lines(angle, None, RATE, channel="x").notes
    assert " Hz drifts in phase; it is fitted in " in note.text


# --- threshold -------------------------------------------------------------------------------


@pytest.mark.parametrize("trials", [300, pytest.param(1200, marks=pytest.mark.statistics)])
@pytest.mark.parametrize("false_alarm", [0.05, 0.3])
def test_threshold_is_passed_by_the_maximum_over_floor_as_often_as_stated(false_alarm, trials):
    samples, window = 4096, 512
    generator = np.random.default_rng(11)
    threshold = detection_threshold(samples // 2, false_alarm)
    passed = 0
    for _ in range(trials):
        # Eight times padded, so that the maximum is that over continuous frequency; the floor
        # is the median of 512 ordinates around, as an analysis knows it.
        power = np.abs(np.fft.rfft(generator.standard_normal(samples), 8 * samples)) ** 2 / samples
        power = power[1:-1]
        ordinates = power[7::8]
        floor = np.array(
            [
                np.median(ordinates[start : start + window]) / np.log(2.0)
                for start in range(0, ordinates.size, window)
            ]
        )
        at = np.minimum(np.arange(power.size) // (8 * window), floor.size - 1)
        passed += np.max(power / floor[at]) > threshold
    # The mean number of passages, of which the stated probability is a bound: 1 - exp(-0.3) is
    # 0.26. Binomial of 1200: 0.006 and 0.013.
    expected = 1.0 - np.exp(-false_alarm)
    assert passed / trials == pytest.approx(expected, abs=3.5 * np.sqrt(expected / trials))


def test_threshold_rises_with_bins_and_with_certainty():
    assert detection_threshold(1000, 0.05) < detection_threshold(100_000, 0.05)
    assert detection_threshold(1000, 0.05) < detection_threshold(1000, 0.001)


# --- lines in table angle --------------------------------------------------------------------


def test_orders_and_tones_on_a_wandering_table_are_told_apart():
    samples = 40_000
    table = wandering_table(samples)
    orders = {1: (3e-7, 0.5), 5: (4e-8, -1.0), 36: (2e-8, 2.0)}
    noise = walk(samples, 7)
    angle = noise + 1e-3 * table + tone(samples, 7.3033, 3e-9)
    for order, (amplitude, phase) in orders.items():
        angle = angle + amplitude * np.cos(order * table + phase)
    angle += 3e-8 * np.cos(7.37 * table + 1.0)
    removal = remove_lines(angle, table, RATE, channel="x-z")
    assert len(removal.lines) == 5
    for order, (amplitude, phase) in orders.items():
        line = found_at(removal.lines, "angle", order, 1e-9)
        assert line.frequency_error == 0.0
        assert line.name == ""
        # Order 1 is Earth rate's as well.
        if order > 1:
            assert line.amplitude == pytest.approx(amplitude, abs=5.0 * line.amplitude_error)
            assert line.phase == pytest.approx(phase, abs=5.0 * line.phase_error)
    between = found_at(removal.lines, "angle", 7.37, 0.01)
    assert between.name == "non-integer order"
    assert between.frequency == pytest.approx(7.37, abs=5.0 * between.frequency_error)
    assert between.frequency_error < 1e-3
    assert between.amplitude == pytest.approx(3e-8, abs=5.0 * between.amplitude_error)
    assert between.phase == pytest.approx(1.0, abs=5.0 * between.phase_error)
    in_time = found_at(removal.lines, "time", 7.3033, 1e-3)
    assert in_time.amplitude == pytest.approx(3e-9, abs=5.0 * in_time.amplitude_error)
    # Table motion, orders and tones out; the noise stays, less a few degrees of freedom.
    assert np.sum(np.diff(removal.residual - noise) ** 2) < 60.0 * SIGMA**2


@pytest.mark.parametrize("draws", [8, pytest.param(25, marks=pytest.mark.statistics)])
def test_non_integer_orders_within_their_stated_errors(draws):
    samples = 20_000
    table = wandering_table(samples, wander=0.005)
    ratios = []
    for seed in range(draws):
        angle = walk(samples, [seed, 8]) + 0.5 * table + 3e-8 * np.cos(7.37 * table + 1.0)
        lines = remove_lines(angle, table, RATE, channel="x").lines
        line = found_at(lines, "angle", 7.37, 0.05)
        ratios.append(
            [
                (line.frequency - 7.37) / line.frequency_error,
                (line.amplitude - 3e-8) / line.amplitude_error,
                (line.phase - 1.0) / line.phase_error,
            ]
        )
    # 2.8 errors of an rms, which that of 25 knows to 14 %.
    chance = 2.0 / np.sqrt(draws)
    assert np.sqrt(np.mean(np.square(ratios), axis=0)) == pytest.approx(np.ones(3), abs=chance)


@pytest.mark.parametrize("cycles", [0.0, 0.6, -0.75, 0.9])
def test_an_order_less_than_a_cycle_off_a_whole_one_is_told_from_it(cycles):
    turns, samples = 6.2, 20_000
    table = np.cumsum(np.linspace(1.0, 0.4, samples))
    table *= TURN * turns / table[-1]
    order = 17.0 + cycles / turns
    ratios = []
    for seed in range(4):
        readings = 2e-6 * np.random.default_rng(seed).standard_normal(samples)
        angle = readings + walk(samples, seed + 50) + 6e-6 * np.cos(order * table + seed)
        lines = remove_lines(angle, table, RATE, channel="x").lines
        # What goes with Earth rate is a thirtieth of it, now and then.
        (line,) = [one for one in lines if one.amplitude > 1e-6]
        assert line.scale == "angle"
        if cycles == 0.0:
            assert line.frequency == order
        else:
            ratios.append((line.frequency - order) / line.frequency_error)
    assert np.all(np.abs(ratios) < 4.0)


def test_sidebands_about_the_table_rate_are_named():
    samples = 30_000
    table = np.radians(40.0) / RATE * np.arange(samples)
    carrier = tone(samples, 23.0071, 3e-7) * (1.0 + 0.1 * np.cos(table + 1.0))
    lines = remove_lines(walk(samples, 9) + 0.5 * table + carrier, table, RATE, channel="x").lines
    turn_rate = 40.0 / 360.0
    assert len(lines) == 3
    assert lines[0].name == ""
    for side in (-1.0, 1.0):
        line = found_at(lines, "time", 23.0071 + side * turn_rate, 1e-3)
        assert line.name == "sideband of 23.0071 Hz at the table rate"
        assert line.amplitude == pytest.approx(1.5e-8, rel=0.05)


def test_part_of_a_turn_leaves_the_noise():
    # A shaft that swings through a tenth of a turn: harmonics bend like table motion itself.
    samples = 30_000
    table = 0.05 * TURN * np.sin(TURN * 0.07 * np.arange(samples) / RATE) + 1.0
    noise = walk(samples, 10)
    angle = noise + 0.5 * table + 3e-5 * np.cos(4.0 * table + 0.3)
    removal = remove_lines(angle, table, RATE, channel="x")
    assert removal.lines
    assert np.std(np.diff(removal.residual)) == pytest.approx(SIGMA, rel=0.02)
    slow = slice(None, None, 100)
    assert np.std(np.diff(removal.residual[slow])) == pytest.approx(
        np.std(np.diff(noise[slow])), rel=0.1
    )


# --- recordings of the rig -------------------------------------------------------------------


def test_ripple_beating_with_earth_rate_makes_no_lines():
    # Ripple of 12 and 36 a turn puts Earth rate into orders 11, 13, 35 and 37.
    base = preset("paper")
    ripple = {"wander_fraction": 0.01, "wander_time_s": 60.0, "ripple": ((12, 5e-3), (36, 2e-3))}
    config = replace(
        base,
        duration_s=600.0,
        sample_rate_hz=RATE,
        table=replace(base.table, **ripple),
        # The search takes a table angle that is known; what a latch does is not its business.
        encoder=replace(base.encoder, latch_jitter_s=0.0),
        disturbances=DisturbancesConfig(),
    )
    made = simulate(config).recording
    difference = made.gyro("x").values - made.gyro("z").values
    lines = remove_lines(difference, made.table.values, RATE, channel="x-z").lines
    assert {line.frequency for line in lines} <= {1.0}


def swinging(amplitude, frequency, highest=60, tones=30) -> tuple[np.ndarray, np.ndarray]:
    """A table that swings, and an angle with even orders and tones on its motion."""
    generator = np.random.default_rng(11)
    seconds = np.arange(20_000) / 100.0
    table = amplitude * np.cos(2.0 * np.pi * frequency * seconds)
    angle = 0.6 * table + np.cumsum(1e-8 * generator.standard_normal(seconds.size))
    for order in range(2, highest + 1, 2):
        angle += 1e-5 * np.cos(order * table + order)
    for tone in np.linspace(11.3, 43.7, tones):
        angle += 1e-5 * np.cos(2.0 * np.pi * tone * seconds + tone)
    return table, angle


def test_a_search_in_which_all_orders_meet_all_tones_ends_with_a_word():
    """Over nine turns: each pair would be a pass over the record, in every fit."""
    table, angle = swinging(29.0, 0.02)
    removal = remove_lines(angle, table, 100.0, channel="z")
    (note,) = [note for note in removal.notes if note.text.startswith("the search stopped")]
    assert "sweeps orders and tones over each other" in note.text
    assert removal.unfinished is not None


def test_over_half_a_turn_a_function_of_the_angle_takes_the_place_of_orders():
    table, angle = swinging(1.5, 0.02)
    removal = remove_lines(angle, table, 100.0, channel="z")
    assert removal.unfinished is None
    (note,) = [note for note in removal.notes if "as one function" in note.text]
    assert "over 0.48 turns" in note.text
    # What swings as slowly is out, to the walk that was put in.
    frequency, density = signal.welch(np.diff(removal.residual), 100.0, nperseg=8192)
    slow = (frequency > 0.1) & (frequency < 1.5)
    assert np.median(density[slow]) == pytest.approx(2.0 * 1e-16 / 100.0, rel=0.5)


def ramp(seed: int, orders: range) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Six turns ever faster beside noisy readings: the table, the angle and the noise in it."""
    generator = np.random.default_rng(seed)
    part = np.linspace(0.0, 1.0, 20_000)
    table = 12.0 * np.pi * (0.4 * part + 0.6 * part**2)
    noise = np.cumsum(1e-8 * generator.standard_normal(part.size))
    noise = noise + 2.5e-5 * generator.standard_normal(part.size)
    return table, noise + sum(4e-6 * np.cos(order * table + order) for order in orders), noise


@pytest.mark.parametrize("seed", [3, 11, 14])
def test_orders_that_hide_below_the_floor_of_a_ramp_go_as_a_function(seed):
    """The search by orders left some of twenty, and 1.2 to 1.9 times the noise."""
    table, angle, noise = ramp(seed, range(1, 40, 2))
    removal = remove_lines(angle, table, 100.0, channel="x")
    assert any("as one function" in note.text for note in removal.notes)
    frequency, left = signal.welch(removal.residual, 100.0, nperseg=10_000)
    made = signal.welch(noise, 100.0, nperseg=10_000)[1]
    orders = (frequency > 0.1) & (frequency < 1.0)
    assert left[orders].mean() == pytest.approx(made[orders].mean(), rel=0.1)


@pytest.mark.parametrize(("seed", "highest"), [(0, 0), (0, 39), (4, 39)])
def test_a_ramp_whose_orders_are_found_has_no_function(seed, highest):
    table, angle, _ = ramp(seed, range(1, highest + 1, 2))
    removal = remove_lines(angle, table, 100.0, channel="x")
    assert not removal.notes


def test_over_some_turns_a_function_takes_over_from_a_search_without_end(monkeypatch):
    table, angle = swinging(16.0, 0.02, highest=12, tones=3)
    by_orders = remove_lines(angle, table, 100.0, channel="z")
    assert len(by_orders.lines) == 9
    assert not by_orders.notes
    monkeypatch.setattr(search, "_MOST_PASSES", 0.1)
    removal = remove_lines(angle, table, 100.0, channel="z")
    assert removal.unfinished is None
    assert any("as one function" in note.text for note in removal.notes)
    for each in (by_orders, removal):
        assert np.std(np.diff(each.residual)) == pytest.approx(1e-8, rel=0.02)


@pytest.mark.parametrize("scale", ["time", "angle"])
def test_a_tone_on_an_order_is_told_from_it_where_the_rate_wanders(scale):
    """8 Hz at 40 deg/s, order 72: named so, it left sidebands that were taken for vibration."""
    rng, rate, samples = np.random.default_rng(14), 100.0, 60_000
    servo = signal.lfilter([np.sqrt(1.0 - 0.967**2)], [1.0, -0.967], rng.standard_normal(samples))
    table = np.deg2rad(np.cumsum(40.0 + 0.01 * servo)) / rate
    phase = 2.0 * np.pi * 8.0 * np.arange(samples) / rate if scale == "time" else 72.0 * table
    angle = 2.5e-7 * np.cos(phase) + np.cumsum(1.7e-9 * rng.standard_normal(samples))
    removal = remove_lines(angle, table, rate, channel="x-z")
    # Order 1 is not told from Earth rate, and of either there is none.
    assert all(line.significance < 20.0 for line in removal.lines if line.frequency == 1.0)
    [line] = [line for line in removal.lines if line.frequency != 1.0]
    assert line.scale == scale
    assert line.frequency == pytest.approx(8.0 if scale == "time" else 72.0, abs=1e-5)
    assert abs(line.amplitude - 2.5e-7) < 4.0 * line.amplitude_error
    assert not [note for note in removal.notes if "vibration" in note.text]
