"""What goes off without aiding: closed forms, and whole rotations of many runs."""

import numpy as np
import pytest
from scipy import integrate

from sagnac.core.units import DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR
from sagnac.navigation.drift import PARTS, bias_is_prior, drift
from sagnac.navigation.error_model import Start
from sagnac.navigation.models import Markov
from sagnac.navigation.noise import GyroNoise
from tests.navigation.strapdown import coloured, unaided

LATITUDE = 45.0 * DEGREE
MINUTE = np.array([60.0])
REST = 120.0


def exact(**priors):
    """Nothing is wrong at the start unless it is stated."""
    return Start(**{"tilt": 0.0, "azimuth": 0.0, **priors})


def heading(noise, times=MINUTE, **priors):
    found = drift((noise,) * 3, latitude=LATITUDE, times=times, priors=exact(**priors))
    return found.heading


def part(growth, name):
    return growth.variances[:, PARTS.index(name)]


def test_white_noise_grows_with_time_and_what_the_rest_left_of_it_with_its_square():
    found = heading(GyroNoise(angle_random_walk=1e-5), rest=REST)
    # Earth rate has turned by 0.25 deg by then.
    assert part(found, "angle_random_walk") == pytest.approx(1e-10 * 60.0, rel=1e-4)
    assert part(found, "initial_bias") == pytest.approx(1e-10 * 60.0**2 / REST, rel=1e-4)
    assert part(found, "misalignment") == 0.0


def test_a_walk_of_the_rate_goes_on_from_what_the_rest_left_of_it():
    found = heading(GyroNoise(angle_random_walk=1e-30, rate_random_walk=1e-7), rest=REST)
    assert part(found, "rate_random_walk") == pytest.approx(1e-14 * 60.0**3 / 3.0, rel=1e-4)
    assert part(found, "initial_bias") == pytest.approx(1e-14 * REST / 3.0 * 60.0**2, rel=1e-4)


@pytest.mark.parametrize("rest", [12.0, 60.0, 900.0])
def test_flicker_is_the_integral_of_its_spectrum(rest):
    found = heading(GyroNoise(angle_random_walk=1e-30, bias_instability=1e-6), rest=rest)
    time = 60.0

    def density(logarithm):
        omega = 2.0 * np.pi * np.exp(logarithm)
        run = (1.0 - np.exp(-1j * omega * time)) / (1j * omega)
        before = (np.exp(1j * omega * rest) - 1.0) / (1j * omega)
        # Two-sided B^2/(2 pi f), both sides, df = f d(ln f).
        return abs(run - time / rest * before) ** 2 * 2.0 / (2.0 * np.pi)

    nodes = np.linspace(np.log(1e-7), np.log(1e2), 200_001)
    wanted = 1e-12 * integrate.trapezoid([density(one) for one in nodes[::20]], nodes[::20])
    assert part(found, "bias_instability") == pytest.approx(wanted, rel=2e-3)
    # Over as long as the rest it is Allan's: 2 t^2 times B^2 2 ln 2/pi.
    if rest == time:
        assert wanted == pytest.approx(1e-12 * time**2 * 4.0 * np.log(2.0) / np.pi, rel=1e-3)


@pytest.mark.parametrize(("rest", "constant"), [(12.0, 5.0), (60.0, 30.0), (900.0, 500.0)])
def test_a_markov_rate_is_the_sum_of_its_covariances(rest, constant):
    noise = GyroNoise(
        angle_random_walk=1e-30, markov=(Markov.of_deviation(1e-5, constant, error=0.1),)
    )
    found = heading(noise, rest=rest)
    time, step = 60.0, 0.25
    moments = np.arange(-rest, time, step) + 0.5 * step
    weight = step * np.where(moments > 0.0, 1.0, -time / rest)
    apart = np.abs(moments[:, np.newaxis] - moments)
    wanted = 1e-10 * weight @ np.exp(-apart / constant) @ weight
    assert part(found, "markov_rate") / wanted == pytest.approx(1.0, rel=2e-3)
    # An error of a tenth of the variance, 1.96 times.
    assert found.reach == pytest.approx(0.196, abs=1e-3)
    assert found.highest / np.sqrt(wanted) == pytest.approx(1.0, rel=2e-3)
    assert part(heading(GyroNoise(angle_random_walk=1e-5)), "markov_rate") == 0.0


def test_two_markov_rates_add_up_and_so_do_the_squares_of_their_errors():
    rates = (
        Markov.of_deviation(1e-5, 5.0, error=0.1),
        Markov.of_deviation(4e-6, 80.0, error=0.3),
    )
    alone = [heading(GyroNoise(angle_random_walk=1e-30, markov=(one,))) for one in rates]
    both = heading(GyroNoise(angle_random_walk=1e-30, markov=rates))
    fast, slow = (float(part(one, "markov_rate")[0]) for one in alone)
    assert float(part(both, "markov_rate")[0]) / (fast + slow) == pytest.approx(1.0, rel=1e-12)
    wanted = 1.959964 * np.hypot(0.1 * fast, 0.3 * slow) / (fast + slow)
    assert float(both.reach[0]) == pytest.approx(wanted, rel=1e-6)
    highest = np.hypot(*(float(one.highest[0]) for one in alone))
    assert float(both.highest[0]) / highest == pytest.approx(1.0, rel=1e-6)


FORCE = GyroNoise(angle_random_walk=1e-4, bias_instability=3e-5, rate_random_walk=2e-6)
QUIET = GyroNoise(angle_random_walk=1e-30)


@pytest.mark.parametrize(
    ("force", "wanted"),
    [
        # Of north and east together: twice N^2 t^3/3 and what the rest left, N^2/T over t^2/2.
        (GyroNoise(angle_random_walk=1e-4), 2e-8 * (60.0**3 / 3.0 + 60.0**4 / 4.0 / REST)),
        (
            GyroNoise(angle_random_walk=1e-30, rate_random_walk=1e-6),
            2e-12 * (60.0**5 / 20.0 + REST / 3.0 * 60.0**4 / 4.0),
        ),
    ],
)
def test_accelerometers_move_the_position_by_what_differs_from_the_rest(force, wanted):
    found = drift(
        (QUIET,) * 3, accelerometers=(force, force), latitude=LATITUDE, times=MINUTE,
        priors=exact(rest=REST),
    )  # fmt: skip
    assert part(found.position, "accelerometers") == pytest.approx(wanted, rel=2e-3)
    assert part(found.heading, "accelerometers") < 1e-12 * wanted
    assert part(heading(QUIET, rest=REST), "accelerometers") == 0.0


def test_an_interval_and_a_bound_of_accelerometers_are_those_of_their_coefficients():
    covariance = np.zeros((3, 3))
    covariance[0, 0] = (0.1e-4) ** 2
    force = GyroNoise(
        angle_random_walk=1e-4, covariance=covariance, bounds={"rate_random_walk": 1e-6}
    )
    raised = GyroNoise(angle_random_walk=1e-4, rate_random_walk=1e-6)

    def position(one):
        return drift(
            (QUIET,) * 3, accelerometers=(one, one), latitude=LATITUDE, times=MINUTE,
            priors=exact(), confidence=0.6827,
        ).position  # fmt: skip

    assert position(force).reach == pytest.approx([0.2], rel=1e-3)
    assert position(force).highest == pytest.approx(position(raised).deviation())


def test_parts_add_up_and_the_misalignment_stays():
    noise = GyroNoise(angle_random_walk=1e-6, bias_instability=1e-7, rate_random_walk=1e-9)
    found = heading(noise, np.array([10.0, 600.0]), rest=REST, azimuth=0.01, tilt=0.001)
    assert found.deviation() ** 2 == pytest.approx(found.variances.sum(axis=1))
    apart = found.deviation(misaligned=False) ** 2 + part(found, "misalignment")
    assert apart == pytest.approx(found.deviation() ** 2)
    # In ten minutes 2.5 deg of Earth's turning mix the axes a little.
    assert np.sqrt(part(found, "misalignment")) == pytest.approx([0.01, 0.01], rel=0.03)


def test_a_bias_known_better_than_the_rest_shows_it_is_the_prior():
    noise = GyroNoise(angle_random_walk=1e-5)
    assert bias_is_prior(noise, Start(rest=100.0, bias=2e-6)) is False
    assert bias_is_prior(noise, Start(rest=100.0, bias=1e-7)) is True
    found = heading(noise, rest=100.0, bias=1e-7)
    assert part(found, "initial_bias") == pytest.approx((1e-7 * 60.0) ** 2, rel=1e-4, abs=0.0)


def test_the_interval_reaches_to_what_a_bound_of_the_walk_allows():
    covariance = np.zeros((3, 3))
    covariance[0, 0] = (0.1e-5) ** 2
    noise = GyroNoise(
        angle_random_walk=1e-5,
        covariance=covariance,
        unseen=("bias_instability", "rate_random_walk"),
        bounds={"rate_random_walk": 1e-6},
    )
    found = heading(noise, rest=REST)
    # N^2 t + K^2 t^3/3, and N^2/T + K^2 T/3 of the rest over t^2.
    white = 1e-10 * (60.0 + 60.0**2 / REST)
    walked = 1e-12 * (60.0**3 / 3.0 + REST / 3.0 * 60.0**2)
    # N is 10 % wrong, 1.96 times.
    factor = np.exp(1.959964 * 0.2)
    assert found.deviation() == pytest.approx([np.sqrt(white)], rel=1e-3)
    low, high = found.interval
    assert low == pytest.approx([np.sqrt(white / factor)], rel=1e-3)
    assert high == pytest.approx([np.sqrt(white * factor + walked)], rel=1e-3)
    assert found.highest == pytest.approx([np.sqrt(white + walked)], rel=1e-3)


def test_slow_noise_is_counted_once_though_b_and_k_are_both_bounded():
    b, k = {"bias_instability": 3e-7}, {"rate_random_walk": 1e-8}
    alone = [heading(GyroNoise(angle_random_walk=1e-6, bounds=bounds)).highest for bounds in (b, k)]
    both = heading(GyroNoise(angle_random_walk=1e-6, bounds={**b, **k})).highest
    assert both == pytest.approx(np.maximum(*alone))
    assert both < np.hypot(*alone)


def test_slow_noise_that_is_only_likely_has_an_interval_that_holds_none_and_its_bound():
    likely = GyroNoise(
        angle_random_walk=1e-6,
        rate_random_walk=1e-8,
        unseen=("bias_instability", "rate_random_walk"),
        bounds={"rate_random_walk": 2e-8},
    )
    ends = [
        heading(GyroNoise(angle_random_walk=1e-6, rate_random_walk=walk)) for walk in (0.0, 2e-8)
    ]
    for end, known in zip(heading(likely).interval, ends, strict=True):
        assert end == pytest.approx(known.deviation())
        # What is known without an error has no width.
        assert known.interval[0] == pytest.approx(known.interval[1])


def test_each_axis_has_its_own_gyro():
    loud, quiet = GyroNoise(angle_random_walk=1e-4), GyroNoise(angle_random_walk=1e-6)
    found = drift((loud, loud, quiet), latitude=LATITUDE, times=MINUTE, priors=exact())
    assert found.heading.deviation() == pytest.approx(heading(quiet).deviation(), rel=0.05)
    assert found.attitude.deviation() > 50.0 * found.heading.deviation()


def test_what_cannot_be_is_refused():
    noise = GyroNoise(angle_random_walk=1e-6)
    for wrong in (
        {"tilt": -1.0},
        {"azimuth": np.nan},
        {"rest": 0.0},
        {"bias": -1.0},
        {"bias": 18.0},
    ):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            Start(**wrong)
    with pytest.raises(ValueError, match="above zero"):
        drift((noise,) * 3, latitude=0.0, times=np.array([0.0]), priors=exact())
    with pytest.raises(ValueError, match="give three"):
        drift((noise,), latitude=0.0, times=MINUTE, priors=exact())


def ratios(noise, *, runs, rest, times, tilt, azimuth, seed, force=None):
    """Foretold over simulated: heading, tilt and position at each time."""
    rates = coloured(
        np.random.default_rng(seed), runs, rest + int(times[-1]), white=noise.angle_random_walk,
        flicker=noise.bias_instability, walk=noise.rate_random_walk,
    )  # fmt: skip
    forces = None
    if force is not None:
        forces = coloured(
            np.random.default_rng(seed + 2), runs, rest + int(times[-1]),
            white=force.angle_random_walk, flicker=force.bias_instability,
            walk=force.rate_random_walk,
        )[:, :, :2]  # fmt: skip
    made = unaided(
        rates, rest=rest, latitude=LATITUDE, tilt=tilt, azimuth=azimuth, seed=seed + 1,
        forces=forces,
    )  # fmt: skip
    at = np.asarray(times, dtype=np.int64) - 1
    square = {name: (values[:, at] ** 2).mean(axis=0) for name, values in made.items()}
    found = drift(
        (noise,) * 3, latitude=LATITUDE, times=np.asarray(times, dtype=np.float64),
        priors=Start(tilt=tilt, azimuth=azimuth, rest=float(rest)),
        accelerometers=() if force is None else (force, force),
    )  # fmt: skip
    return np.array(
        [
            found.heading.deviation() / np.sqrt(square["heading"]),
            found.attitude.deviation() / np.sqrt(0.5 * (square["north"] + square["east"])),
            found.position.deviation() / np.sqrt(square["x"] + square["y"]),
        ]
    )


@pytest.mark.parametrize("force", [None, FORCE])
def test_few_runs_err_by_what_is_foretold(force):
    noise = GyroNoise(angle_random_walk=2e-5, bias_instability=2e-6, rate_random_walk=1e-7)
    tilt = 1e-4 if force is None else 1e-7
    found = ratios(
        noise, runs=300, rest=60, times=(20, 150), tilt=tilt, azimuth=2e-4, seed=5, force=force
    )
    # The root mean square of 300 runs scatters by 4 %.
    assert found == pytest.approx(np.ones((3, 2)), rel=0.12)


KINDS = {
    "ring laser": (5e-4, 1e-3, 1e-4),  # deg/sqrt(h), deg/h, deg/h/sqrt(h)
    "fibre": (0.01, 0.02, 0.02),
    "tactical MEMS": (0.1, 2.0, 1.0),
    "MEMS": (0.4, 8.0, 5.0),
}


@pytest.mark.statistics
@pytest.mark.parametrize("kind", KINDS)
def test_heading_over_an_hour_is_foretold_within_five_per_cent(kind):
    white, flicker, walk = KINDS[kind]
    noise = GyroNoise(
        angle_random_walk=white * DEGREE_PER_ROOT_HOUR,
        bias_instability=flicker * DEGREE_PER_HOUR,
        rate_random_walk=walk * DEGREE_PER_HOUR / 60.0,
    )
    times = (10, 60, 600, 3600)
    # 8 batches of 250: one after the other in little memory.
    squares = [
        ratios(noise, runs=250, rest=600, times=times, tilt=1e-5, azimuth=1e-5, seed=2 * batch)
        ** -2.0
        for batch in range(8)
    ]
    found = np.mean(squares, axis=0) ** -0.5
    print(kind, np.round(found, 3).tolist())
    # The root mean square of 2000 runs scatters by 1.6 %.
    assert found == pytest.approx(np.ones((3, 4)), abs=0.05)
