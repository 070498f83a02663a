"""Sections of the rig's configuration: what each key holds, its range and its meaning."""

from dataclasses import dataclass
from typing import Annotated, Final, Literal, get_args

from sagnac.rig.validation import Choice, Number, PairsOf, PerGyro, Whole, check

Triple = tuple[float, float, float]
Pairs = tuple[tuple[float, float], ...]
GyroMode = Literal["ideal", "still", "dithered", "rate-biased"]
JitterSpectrum = Literal["position", "rate"]
AfterDwell = Literal["back", "onward"]
Accelerometers = Literal["none", "triad"]
GYRO_NAMES: Final = ("x", "y", "z")
ACCELEROMETER_NAMES: Final = ("ax", "ay", "az")
_ORDER: Final = Number(0.01, 1000.0, "order")
LONGEST_DELAY_S: Final = 2.0
_ARCSECONDS: Final = Number(0.0, 3600.0, "arcsec")


@dataclass(frozen=True, slots=True, kw_only=True)
class TableConfig:
    """The turntable: commanded motion and what its servo and bearing add.

    Raises
    ------
    ConfigurationError
        If a key holds what it must not, here and in every section.
    """

    rate_deg_per_s: Annotated[
        float, Number(-400.0, 400.0, "commanded rate; the sign is the direction")
    ] = 40.0
    start_deg: Annotated[
        float, Number(-360.0, 360.0, "commanded table angle at the first sample, from the null")
    ] = 0.0
    reversal_interval_s: Annotated[
        float, Number(0.0, 1e6, "time between reversals or dwells, 0 for none")
    ] = 0.0
    dwell_s: Annotated[float, Number(0.0, 1e6, "time for which the table stands at each")] = 0.0
    after_dwell: Annotated[
        AfterDwell,
        Choice(
            get_args(AfterDwell), "whether the table then turns back, or onward as it did before"
        ),
    ] = "back"
    acceleration_deg_per_s2: Annotated[
        float, Number(0.1, 1e4, "acceleration of a reversal, and at a dwell")
    ] = 100.0
    profile: Annotated[
        Pairs,
        PairsOf(
            Number(0.0, 1e7, "time s"),
            Number(-400.0, 400.0, "rate deg/s"),
            "commanded rate at given times, straight between; replaces rate and reversals",
        ),
    ] = ()
    jitter_rms_deg_per_s: Annotated[float, Number(0.0, 10.0, "rms rate jitter of the servo")] = 0.0
    jitter_bandwidth_hz: Annotated[
        float, Number(0.01, 1000.0, "natural frequency of the jitter")
    ] = 8.0
    jitter_damping: Annotated[
        float, Number(0.01, 10.0, "damping ratio of the servo, with `position`")
    ] = 0.5
    jitter_spectrum: Annotated[
        JitterSpectrum,
        Choice(
            get_args(JitterSpectrum),
            "`position`: the servo holds the angle; `rate`: it holds the rate and the angle walks",
        ),
    ] = "position"
    wander_fraction: Annotated[
        float, Number(0.0, 0.2, "rms slow wander of the rate, as a part of it")
    ] = 0.0
    wander_time_s: Annotated[float, Number(1.0, 1e6, "correlation time of the wander")] = 300.0
    hunting_rms_deg_per_s: Annotated[
        float, Number(0.0, 10.0, "rms rate of a servo that hunts about one frequency")
    ] = 0.0
    hunting_hz: Annotated[float, Number(0.1, 100.0, "that frequency")] = 3.0
    hunting_quality: Annotated[
        float, Number(0.5, 1000.0, "that frequency over the width of the hunting's band")
    ] = 10.0
    ripple: Annotated[
        Pairs,
        PairsOf(
            _ORDER,
            Number(0.0, 0.2, "fraction"),
            "ripple of the rate at orders of the drive angle, as a part of the rate",
        ),
    ] = ()
    wobble: Annotated[
        Pairs,
        PairsOf(
            Number(0.01, 100.0, "order"),
            _ARCSECONDS,
            "tilt of the shaft, turning with orders of the table angle",
        ),
    ] = ()

    def __post_init__(self) -> None:
        check(self, "table.")

    @property
    def turning(self) -> bool:
        """Whether the table is commanded to move at all."""
        if self.profile:
            return any(rate != 0.0 for _, rate in self.profile)
        return self.rate_deg_per_s != 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderConfig:
    """The angle encoder and its null pulse."""

    lines: Annotated[int, Whole(4, 2**31, "steps per turn")] = 7_200_000
    periodic_error: Annotated[
        Pairs,
        PairsOf(
            _ORDER,
            _ARCSECONDS,
            "graduation error at orders of the table angle",
        ),
    ] = ()
    null_accuracy_arcsec: Annotated[float, Number(0.0, 600.0, "rms error of one null passage")] = (
        2.0
    )
    latch_jitter_s: Annotated[
        float, Number(0.0, 0.01, "rms time between the encoder's sample and the gyros'")
    ] = 0.0
    latency_s: Annotated[
        float, Number(0.0, LONGEST_DELAY_S, "time by which a reading is late at the start")
    ] = 0.0
    latency_drift_s: Annotated[
        float,
        Number(
            -LONGEST_DELAY_S,
            LONGEST_DELAY_S,
            "what the latency has gained at the end; with clock_ppm it keeps to the same limits",
        ),
    ] = 0.0
    latency_walk_s: Annotated[
        float, Number(0.0, 1e-3, "rms of a random walk of the latency after half an hour")
    ] = 0.0
    clock_ppm: Annotated[
        float,
        Number(-1000.0, 1000.0, "by which its clock runs fast, so that readings fall behind"),
    ] = 0.0
    reading_rate_hz: Annotated[
        float, Number(0.0, 1e5, "readings a second, each held to the next; 0 for one a sample")
    ] = 0.0
    lost_fraction: Annotated[
        float, Number(0.0, 0.9, "part of the readings that repeat the one before")
    ] = 0.0
    missing_null_fraction: Annotated[
        float, Number(0.0, 1.0, "part of the null pulses that are missing")
    ] = 0.0

    def __post_init__(self) -> None:
        check(self, "encoder.")


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionConfig:
    """Random motion that gyros do not share, while the table turns (`sagnac.rig.own_motion`)."""

    resonance_rms_arcsec: Annotated[
        Triple,
        PerGyro(0.0, 3600.0, "rms angle by which each gyro's mount shakes about the input axis"),
    ] = (0.0, 0.0, 0.0)
    resonance_hz: Annotated[Triple, PerGyro(0.1, 1e4, "resonance of each mount")] = (
        17.0,
        17.0,
        17.0,
    )
    resonance_quality: Annotated[
        float, Number(0.5, 1000.0, "resonance of a mount over its width")
    ] = 20.0
    nutation_rms_arcsec: Annotated[
        float, Number(0.0, 60.0, "rms random tilt of the shaft about each level axis")
    ] = 0.0
    nutation_hz: Annotated[
        float, Number(0.1, 1e4, "frequency of that tilting, to a quarter of sample_rate_hz")
    ] = 10.0
    nutation_quality: Annotated[
        float, Number(0.5, 1000.0, "that frequency over the width of its band")
    ] = 5.0

    def __post_init__(self) -> None:
        check(self, "motion.")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlatformConfig:
    """How the triad sits on the table and where the table stands."""

    share_deviation: Annotated[
        Triple,
        PerGyro(
            -0.05, 0.05, "of e_x, e_y, e_z from 1/sqrt(3); the three are scaled to unit length"
        ),
    ] = (0.0, 0.0, 0.0)
    latitude_deg: Annotated[float, Number(-90.0, 90.0, "north positive")] = 28.2
    heading_deg: Annotated[float, Number(-360.0, 360.0, "of the null pulse, from north")] = 0.0

    def __post_init__(self) -> None:
        check(self, "platform.")


@dataclass(frozen=True, slots=True, kw_only=True)
class GyroConfig:
    """The three gyros: one number for all of them, or a list for x, y, z."""

    mode: Annotated[
        GyroMode,
        Choice(
            get_args(GyroMode),
            "`ideal`: no lock-in; the others are a ring laser: at rest without dither, "
            "dithered, or held above lock-in by the table",
        ),
    ] = "ideal"
    arw_deg_per_sqrt_h: Annotated[
        Triple, PerGyro(0.0, 10.0, "angle random walk N; of a ring laser its quantum limit")
    ] = (2.5e-5, 2.5e-5, 2.5e-5)
    quantization_step_arcsec: Annotated[
        Triple, PerGyro(0.0, 3600.0, "readout step, 0 for none; Q is the step over sqrt(12)")
    ] = (0.001, 0.001, 0.001)
    angle_noise_arcsec: Annotated[
        Triple, PerGyro(0.0, 3600.0, "white noise of the sampled angle: Q without a readout step")
    ] = (0.0, 0.0, 0.0)
    bias_deg_per_h: Annotated[Triple, PerGyro(-1e5, 1e5, "constant bias")] = (0.0, 0.0, 0.0)
    bias_instability_deg_per_h: Annotated[
        Triple, PerGyro(0.0, 1e4, "bias instability B: flicker of the rate, below 25 Hz")
    ] = (0.0, 0.0, 0.0)
    rate_random_walk_deg_per_h_per_sqrt_h: Annotated[
        Triple, PerGyro(0.0, 1e4, "rate random walk K")
    ] = (0.0, 0.0, 0.0)
    markov_deviation_deg_per_h: Annotated[
        Triple, PerGyro(0.0, 1e5, "standard deviation of a first-order Markov rate")
    ] = (0.0, 0.0, 0.0)
    markov_time_s: Annotated[Triple, PerGyro(0.1, 1e6, "its correlation time")] = (
        100.0,
        100.0,
        100.0,
    )
    rate_ramp_deg_per_h_per_h: Annotated[Triple, PerGyro(-1e4, 1e4, "rate ramp R")] = (
        0.0,
        0.0,
        0.0,
    )
    temperature_coefficient_deg_per_h_per_k: Annotated[
        Triple, PerGyro(-1e3, 1e3, "bias per kelvin of warming up")
    ] = (0.0, 0.0, 0.0)
    warm_up_k: Annotated[float, Number(-100.0, 100.0, "temperature rise after a long time")] = 0.0
    warm_up_time_s: Annotated[float, Number(1.0, 1e6, "time constant of the rise")] = 1800.0
    lock_in_deg_per_h: Annotated[Triple, PerGyro(0.001, 1e5, "lock-in rate of the ring laser")] = (
        24.0,
        26.0,
        28.0,
    )
    fringe_arcsec: Annotated[
        float, Number(0.01, 100.0, "input angle per beat of the ring laser")
    ] = 1.5
    backscatter_diffusion_rad2_per_s: Annotated[
        float,
        Number(0.0, 1e6, "D of the backscatter phase, whose variance grows by 2 D t; assumed"),
    ] = 150.0
    dither_frequency_hz: Annotated[float, Number(1.0, 1e4, "frequency of the dither")] = 400.0
    dither_rate_deg_per_s: Annotated[float, Number(0.1, 1e4, "peak rate of the dither")] = 100.0
    dither_amplitude_noise: Annotated[
        float, Number(0.0, 0.5, "rms of the peak rate from swing to swing, as a part of it")
    ] = 0.02
    low_pass_hz: Annotated[
        Triple, PerGyro(0.0, 1e5, "corner (-3 dB) of the sensor's own low-pass, 0 for none")
    ] = (0.0, 0.0, 0.0)
    low_pass_order: Annotated[int, Whole(1, 2, "of that low-pass, a Butterworth filter")] = 1

    def __post_init__(self) -> None:
        check(self, "gyro.")


_NONE: Final = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class AccelerometerConfig:
    """Three accelerometers along the axes of the gyros, with gravity: one number, or three."""

    mode: Annotated[
        Accelerometers, Choice(get_args(Accelerometers), "whether there are ax, ay and az")
    ] = "none"
    vrw_m_per_s_per_sqrt_h: Annotated[Triple, PerGyro(0.0, 100.0, "velocity random walk N")] = _NONE
    velocity_noise_mm_per_s: Annotated[
        Triple, PerGyro(0.0, 1e4, "white noise of the sampled velocity: Q without a readout step")
    ] = _NONE
    quantization_step_mm_per_s: Annotated[Triple, PerGyro(0.0, 1e4, "readout step, 0 for none")] = (
        _NONE
    )
    bias_mg: Annotated[Triple, PerGyro(-1e3, 1e3, "constant bias")] = _NONE
    bias_instability_mg: Annotated[Triple, PerGyro(0.0, 1e3, "bias instability B, below 25 Hz")] = (
        _NONE
    )
    acceleration_random_walk_mg_per_sqrt_h: Annotated[
        Triple, PerGyro(0.0, 1e3, "acceleration random walk K")
    ] = _NONE
    markov_deviation_mg: Annotated[
        Triple, PerGyro(0.0, 1e3, "standard deviation of a first-order Markov acceleration")
    ] = _NONE
    markov_time_s: Annotated[Triple, PerGyro(0.1, 1e6, "its correlation time")] = (
        100.0,
        100.0,
        100.0,
    )
    acceleration_ramp_mg_per_h: Annotated[Triple, PerGyro(-1e3, 1e3, "acceleration ramp R")] = _NONE
    low_pass_hz: Annotated[
        Triple, PerGyro(0.0, 1e5, "corner (-3 dB) of the sensor's own low-pass, 0 for none")
    ] = _NONE
    low_pass_order: Annotated[int, Whole(1, 2, "of that low-pass, a Butterworth filter")] = 1

    def __post_init__(self) -> None:
        check(self, "accelerometer.")


@dataclass(frozen=True, slots=True, kw_only=True)
class DitherConfig:
    """Dither left in the angles of a dithered gyro, and how its pick-off shows it.

    Its frequency, rate and randomisation stand in `GyroConfig`. With nothing left there is no
    pick-off in the recording either.
    """

    residue: Annotated[
        Triple, PerGyro(0.0, 1.0, "part of the dither that the gyro's own stripping leaves")
    ] = (0.0, 0.0, 0.0)
    delay_s: Annotated[
        Triple, PerGyro(-1e-3, 1e-3, "time by which the gyro's own stripping is late")
    ] = (0.0, 0.0, 0.0)
    detuning_hz: Annotated[
        Triple, PerGyro(-100.0, 100.0, "of each gyro's dither from gyro.dither_frequency_hz")
    ] = (-12.7, 0.0, 11.3)
    ring_down_s: Annotated[
        float, Number(0.01, 1e4, "correlation time of the dither's random amplitude and phase")
    ] = 0.5
    pickoff_noise_arcsec: Annotated[
        float, Number(0.0, 3600.0, "rms noise of a pick-off from sample to sample")
    ] = 0.01

    def __post_init__(self) -> None:
        check(self, "dither.")

    @property
    def is_left(self) -> bool:
        """Whether any gyro has dither in its angle."""
        return any(self.residue) or any(self.delay_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class DisturbanceConfig:
    """Periodic disturbances of the gyro angles, Eqs. 10 and 11.

    Each gyro takes between half and all of each amplitude, at a phase of its own.
    """

    angle: Annotated[
        Pairs,
        PairsOf(
            _ORDER,
            _ARCSECONDS,
            "harmonics of the table angle, Eq. 10",
        ),
    ] = ()
    time: Annotated[
        Pairs,
        PairsOf(
            Number(1e-6, 1e5, "frequency Hz"),
            _ARCSECONDS,
            "lines in time, Eq. 11",
        ),
    ] = ()

    def __post_init__(self) -> None:
        check(self, "disturbances.")
