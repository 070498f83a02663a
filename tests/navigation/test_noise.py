import json

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.core.units import DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR
from sagnac.navigation.align import align
from sagnac.navigation.noise import GyroNoise
from sagnac.report.alignment import drift_notes
from sagnac.report.document import analysis_document
from tests.handmade import analysis


def document() -> dict:
    def one(value, unit, status="estimated"):
        ends = {"low": value, "high": value, "confidence": 0.95}
        return {"value": value, **ends, "unit": unit, "status": status}

    return {
        **analysis_document(analysis()),
        "angle_random_walk": {**one(0.002, "deg/sqrt(h)"), "source": "by hand"},
        "coefficients": {
            "angle_random_walk": one(0.5, "deg/sqrt(h)"),
            "bias_instability": one(0.01, "deg/h"),
            "rate_random_walk": one(None, "deg/h/sqrt(h)", "not observable"),
        },
        "covariance": {
            "names": ["bias_instability", "angle_random_walk"],
            "units": ["deg/h", "deg/sqrt(h)"],
            "matrix": [[1e-6, -2e-8], [-2e-8, 4e-9]],
        },
    }


def test_analysis_is_read_in_its_units(tmp_path) -> None:
    path = tmp_path / "analysis.json"
    path.write_text(json.dumps(document()))
    noise = GyroNoise.unit(path)[0][0]
    assert noise.values == pytest.approx([0.002 * DEGREE_PER_ROOT_HOUR, 0.01 * DEGREE_PER_HOUR, 0])
    assert noise.unseen == ("rate_random_walk",)
    shares = np.array([DEGREE_PER_ROOT_HOUR, DEGREE_PER_HOUR, 1.0])
    wanted = np.array([[4e-9, -2e-8, 0], [-2e-8, 1e-6, 0], [0, 0, 0]]) * np.outer(shares, shares)
    assert noise.covariance == pytest.approx(wanted, rel=1e-12, abs=0.0)


def test_a_covariance_of_nothing_is_zero():
    stated = {**document(), "covariance": {"names": [], "units": [], "matrix": []}}
    assert not GyroNoise.from_document(stated).covariance.any()


def test_slow_noise_that_b_and_k_are_not_told_apart_in_is_taken():
    stated = document()
    bound = {"value": 0.02, "low": 0.0, "high": 0.02, "confidence": 0.95, "unit": "deg/h"}
    stated["coefficients"]["bias_instability"] = {**bound, "status": "upper bound"}
    without = GyroNoise.from_document(stated)
    assert (without.bias_instability, without.markov) == (0.0, ())
    stated["slow_noise"] = {
        "bias_instability": {"value": 0.01, "unit": "deg/h"},
        "rate_random_walk": {"value": 0.0, "unit": "deg/h/sqrt(h)"},
        "markov": {
            "deviation": {"value": 0.03, "low": 0.027, "high": 0.1 / 3.0, "unit": "deg/h"},
            "correlation_time_s": {"value": 25.0, "low": 20.0, "high": 31.25},
        },
    }
    slower = {"deviation": {"value": 0.02, "unit": "deg/h"}, "correlation_time_s": {"value": 700.0}}
    stated["slow_noise"]["second_markov"] = slower
    noise = GyroNoise.from_document(stated)
    (rate, second) = noise.markov
    told = (noise.bias_instability, rate.deviation, second.deviation)
    assert told == pytest.approx(np.array([0.01, 0.03, 0.02]) * DEGREE_PER_HOUR, abs=0.0)
    assert (rate.correlation_time, second.correlation_time, second.error) == (25.0, 700.0, 0.0)
    # Half intervals of 95 % of the logarithms of the square and of the time.
    wanted = np.hypot(2.0 * np.log(1.0 / 0.9), np.log(1.25)) / 1.959964
    assert rate.error == pytest.approx(wanted, rel=1e-6)
    assert noise.bounds == without.bounds
    # What is estimated stays as it is.
    stated["coefficients"] = document()["coefficients"]
    assert GyroNoise.from_document(stated).bias_instability == pytest.approx(
        0.01 * DEGREE_PER_HOUR, abs=0.0
    )


def of_gyro(walk, flicker, ends=(1.0, 1.0)):
    """The document of a gyro of N, °/√h, and B, °/h; `ends` of the interval of N over its value."""
    stated = document()
    low, high = (walk * end for end in ends)
    stated["angle_random_walk"] |= {"value": walk, "low": low, "high": high}
    stated["coefficients"]["bias_instability"] |= dict.fromkeys(("value", "low", "high"), flicker)
    return {**stated, "covariance": None}


@pytest.mark.parametrize(("flicker", "louder"), [(0.0001, "z"), (0.5, "x")])
def test_the_louder_of_two_gyros_stands_for_the_third_axis_alone(tmp_path, flicker, louder):
    # At ten minutes 0.002 °/√h are 0.005 °/h, and a flicker of 0.5 °/h is 0.33 °/h.
    two = {"x": of_gyro(0.002, flicker), "z": of_gyro(0.003, 0.0001)}
    path = tmp_path / "analysis.json"
    path.write_text(json.dumps({**document(), "channel": "x", "gyros": two}))
    ahead = align(path, after=[60.0])
    north, east, down = ahead.unaided.noises
    walks = np.array([north.angle_random_walk, down.angle_random_walk]) / DEGREE_PER_ROOT_HOUR
    assert walks == pytest.approx([0.002, 0.003])
    assert east is {"x": north, "z": down}[louder]
    # Heading goes off by the gyro about down: N² (t + t²/T), and 0.0001 °/h of flicker are nothing.
    heading = ahead.unaided.drift.heading.deviation(misaligned=False)
    made = 0.003 * DEGREE_PER_ROOT_HOUR * np.sqrt(60.0 + 60.0**2 / 600.0)
    assert heading == pytest.approx(made, rel=0.01)
    assert "the louder of two gyros stands for the third axis" in drift_notes(ahead.unaided)


def test_heading_goes_off_by_the_gyro_whose_name_ends_in_z(tmp_path):
    three = {name: of_gyro(0.002, 0.0001) for name in ("gz", "gx", "gy")}
    three["gx"] = of_gyro(0.02, 0.0001)
    path = tmp_path / "analysis.json"
    path.write_text(json.dumps({**document(), "channel": "gz", "gyros": three}))
    ahead = align(path, after=[60.0])
    walks = [one.angle_random_walk / DEGREE_PER_ROOT_HOUR for one in ahead.unaided.noises]
    assert walks == pytest.approx([0.02, 0.002, 0.002])
    assert "stands for" not in drift_notes(ahead.unaided)


def test_an_interval_of_n_that_reaches_far_up_bounds_heading_by_its_upper_end(tmp_path):
    path = tmp_path / "analysis.json"
    path.write_text(json.dumps(of_gyro(0.002, 0.0, ends=(0.5, 40.0))))
    heading = align(path, after=[60.0]).unaided.drift.heading
    made = 0.002 * DEGREE_PER_ROOT_HOUR * np.sqrt(60.0 + 60.0**2 / 600.0)
    low, high = heading.interval
    assert low < 0.5 * made
    assert high == pytest.approx(40.0 * made, rel=0.01)


def test_accelerometers_are_read_in_their_units():
    def force(walk):
        stated = {
            "velocity_random_walk": (walk, "m/s/sqrt(h)"),
            "bias_instability": (0.02, "mg"),
            "acceleration_random_walk": (0.3, "mg/sqrt(h)"),
        }
        made = {
            name: {"value": value, "low": value, "high": value, "confidence": 0.95, "unit": unit,
                   "status": "estimated"}
            for name, (value, unit) in stated.items()
        }  # fmt: skip
        matrix = [[1e-8, 2e-9], [2e-9, 4e-6]]
        names = ["velocity_random_walk", "bias_instability"]
        return {
            "velocity_random_walk": made["velocity_random_walk"],
            "coefficients": made,
            "covariance": {"names": names, "units": ["m/s/sqrt(h)", "mg"], "matrix": matrix},
        }

    three = {"ax": force(0.01), "ay": force(0.02), "az": force(0.03)}
    _, (north, east) = GyroNoise.unit({**document(), "accelerometers": three})
    milli = 9.80665e-3
    assert north.values == pytest.approx([0.01 / 60.0, 0.02 * milli, 0.3 * milli / 60.0])
    assert east.angle_random_walk == pytest.approx(0.02 / 60.0)
    shares = np.array([1.0 / 60.0, milli, 0.0])
    wanted = np.array([[1e-8, 2e-9, 0], [2e-9, 4e-6, 0], [0, 0, 0]]) * np.outer(shares, shares)
    assert north.covariance == pytest.approx(wanted, rel=1e-12, abs=0.0)
    # Other names say nothing of north and east: the loudest stands for both.
    others = {"a": three["ax"], "b": three["az"]}
    _, (north, east) = GyroNoise.unit({**document(), "accelerometers": others})
    assert north is east
    assert north.angle_random_walk == pytest.approx(0.03 / 60.0)
    assert GyroNoise.unit(document())[1] == ()


def test_without_a_covariance_the_intervals_count(tmp_path) -> None:
    stated = document()
    stated["covariance"] = None
    walk = stated["angle_random_walk"]
    walk.update(low=0.002 - 1.96e-4, high=0.002 + 1.96e-4)
    noise = GyroNoise.from_document(stated)
    found = np.sqrt(np.diag(noise.covariance)) / [DEGREE_PER_ROOT_HOUR, DEGREE_PER_HOUR, 1.0]
    assert found == pytest.approx([1e-4, 0.0, 0.0], rel=1e-4)


def test_bound_of_n_is_taken_as_n() -> None:
    stated = document()
    stated["angle_random_walk"]["status"] = "upper bound"
    noise = GyroNoise.from_document(stated)
    assert noise.angle_random_walk == pytest.approx(0.002 * DEGREE_PER_ROOT_HOUR)
    assert "angle_random_walk" in noise.unseen
    assert noise.covariance[0, 0] == 0.0


def test_files_that_are_no_analysis_are_refused(tmp_path) -> None:
    for text, said in (("{", "is no JSON"), ("[]", "schema"), ('{"schema": "x"}', "schema")):
        path = tmp_path / "analysis.json"
        path.write_text(text)
        with pytest.raises(RecordingError, match=said) as caught:
            GyroNoise.unit(path)[0][0]
        assert str(path) in str(caught.value)
    stated = document()
    stated["angle_random_walk"] = {"value": None, "unit": "deg/sqrt(h)", "status": "not observable"}
    with pytest.raises(RecordingError, match="longer recording"):
        GyroNoise.from_document(stated)


def test_each_gyro_of_a_triad_has_its_own_walk(tmp_path):
    """Over minutes heading is that of the gyro about down; of a pair, that of the pair's."""
    path, own = tmp_path / "analysis.json", {"x": 0.002, "y": 0.004, "z": 0.003}
    alone = {**document(), "covariance": None}
    nothing = {**alone["coefficients"]["rate_random_walk"], "unit": "deg/h"}
    alone["coefficients"]["bias_instability"] = nothing
    walks = {name: {**alone["angle_random_walk"], "value": walk} for name, walk in own.items()}
    for per_gyro, walk in ((walks, own["z"]), ({}, 0.002)):
        path.write_text(json.dumps({**alone, "per_gyro": per_gyro}))
        drift = align(path, after=[60.0]).unaided.drift
        made = walk * DEGREE_PER_ROOT_HOUR * np.sqrt(60.0 + 60.0**2 / 600.0)
        assert drift.heading.deviation(misaligned=False)[0] == pytest.approx(made, rel=1e-3)
    # One that was not seen has the loudest of the others, y.
    del walks["z"]["value"]
    walks["z"]["status"] = "not observable"
    _, _, down = GyroNoise.unit({**alone, "per_gyro": walks})[0]
    assert down.angle_random_walk == pytest.approx(own["y"] * DEGREE_PER_ROOT_HOUR)
    # If none is seen, the pair tells nothing of the third.
    with pytest.raises(RecordingError, match="not observable"):
        GyroNoise.unit({**alone, "per_gyro": dict.fromkeys(walks, walks["z"])})
