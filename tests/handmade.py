"""An Analysis put together by hand: the report's input without the analysis that makes it."""

import math

import numpy as np

from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Settings
from sagnac.analysis.spectra import Spectrum
from sagnac.core.errors import Note
from sagnac.lines.model import Line
from sagnac.noise.estimates import Estimate, Fit
from sagnac.recording.model import Channel, Provenance, Recording
from sagnac.stability.curve import StabilityCurve

ARCSECOND = math.pi / 648_000.0
DEGREE = math.pi / 180.0
N = 2.5e-5 * DEGREE / 60.0  # 2.5e-5 deg/sqrt(h)
SHA256 = "0123456789abcdef" * 4


def estimate(
    value: float,
    spread: float = 0.02,
    status: str = "estimated",
    name: str = "angle_random_walk",
) -> Estimate:
    low, high = {
        "not observable": (math.nan, math.nan),
        "upper bound": (0.0, value),
        "estimated": (value * (1 - spread), value * (1 + spread)),
    }[status]
    value = math.nan if status == "not observable" else value
    return Estimate(value=value, low=low, high=high, confidence=0.95, status=status, name=name)


def curve(tau: np.ndarray, deviation: np.ndarray) -> StabilityCurve:
    edf = np.maximum(7200.0 / tau, 1.0)
    return StabilityCurve(
        tau=tau,
        deviation=deviation,
        terms=np.maximum(7200 - 2 * tau, 1).astype(np.int64),
        edf=edf,
        low=deviation * (1 - 1.2 / np.sqrt(edf + 2)),
        high=deviation * (1 + 1.9 / np.sqrt(edf)),
        noise_type=np.zeros(tau.size, dtype=np.int64),
        estimator="oadev",
        kind="angle",
        sample_rate=1.0,
        confidence=0.95,
        samples=7200,
    )


def line(scale: str, frequency: float, amplitude: float, name: str = "") -> Line:
    return Line(
        scale=scale,
        frequency=frequency,
        frequency_error=0.0 if scale == "angle" else 3.2e-7,
        amplitude=amplitude * ARCSECOND,
        amplitude_error=0.0004 * ARCSECOND,
        phase=0.3,
        phase_error=0.01,
        significance=(amplitude / 0.0004) ** 2,
        channel="x-z",
        name=name,
    )


def analysis(
    *,
    gyros: tuple[str, ...] = ("x", "z"),
    method: str = "fos",
    answer: Estimate | None = None,
    notes: tuple[Note, ...] = (
        Note(text="table angle & time are <nearly> one basis: condition 4.1e5"),
    ),
    lines: tuple[Line, ...] | None = None,
    table_rate: float | None = 40.0 * DEGREE,
    provenance: bool = True,
) -> Analysis:
    random = np.random.default_rng(11)
    answer = answer or estimate(N)
    tau = np.unique(np.round(np.geomspace(1, 2400, 45)))
    model = N**2 / tau + 3 * (3e-4 * ARCSECOND) ** 2 / tau**2 + 1e-22 * tau / 3
    wiggle = 1 + random.normal(size=tau.size) * 0.4 * np.sqrt(tau / 7200.0)
    tones = 1e-9 * np.abs(np.sin(np.pi * tau * 0.0137)) ** 2 / tau
    frequency = np.geomspace(1 / 7200, 250, 2000)
    bins = np.maximum(np.round(np.gradient(frequency) * 7200), 1)
    density = 2 * (N**2 + (1e-22 / (2 * np.pi * frequency) ** 2)) * random.gamma(bins, 1 / bins)
    before = density.copy()
    found = (
        (
            line("angle", 1, 0.6),
            line("angle", 2, 0.32),
            line("angle", 12, 0.2),
            line("time", 50.0003, 0.08, "mains <50 Hz>"),
            line("time", 0.0137, 0.05),
        )
        if lines is None
        else lines
    )
    for item in found:
        where = item.frequency if item.scale == "time" else item.frequency / 9.0
        before[np.argmin(np.abs(frequency - where))] *= 3e4
    channels = tuple(
        Channel(name=name, kind="angle", shown_in="arcsec", values=np.zeros(3600)) for name in gyros
    )
    recording = Recording(
        gyros=channels,
        sample_rate=0.5,
        provenance=Provenance(path="run.parquet", sha256=SHA256, format="parquet")
        if provenance
        else None,
    )
    unseen = estimate(0.0, status="not observable", name="rate_ramp")
    coefficients = {
        "quantization": estimate(3e-4 * ARCSECOND, 0.2, name="quantization"),
        "angle_random_walk": answer,
        "bias_instability": estimate(2e-11, status="upper bound", name="bias_instability"),
        "rate_random_walk": estimate(1e-11, 0.35, name="rate_random_walk"),
        "rate_ramp": unseen,
    }
    return Analysis(
        recording=recording,
        settings=Settings(gyros=gyros, method=method, interval=1.0),
        channel="-".join(gyros[:: len(gyros) - 1]) if len(gyros) > 1 else gyros[0],
        table_rate=table_rate,
        angle_random_walk=answer,
        source="likelihood fit of the spectrum, 0.0006 to 0.5 Hz",
        fits={
            "paper": Fit(
                method="paper",
                coefficients={**coefficients, "angle_random_walk": estimate(1.03 * N, 0.05)},
            ),
            "weighted": Fit(
                method="weighted",
                coefficients={**coefficients, "angle_random_walk": estimate(1.01 * N, 0.03)},
            ),
            "likelihood": Fit(method="likelihood", coefficients=coefficients),
        },
        lines=found,
        curve=curve(tau, np.sqrt(model) * wiggle),
        curve_before=curve(tau, np.sqrt(model + tones) * wiggle),
        spectrum=Spectrum(frequency=frequency, density=density),
        spectrum_before=Spectrum(frequency=frequency, density=before),
        per_gyro={name: estimate(N, 0.04) for name in gyros} if len(gyros) == 3 else {},
        notes=notes,
        seconds={"read": 0.11, "lines": 1.94, "stability": 0.2},
    )
