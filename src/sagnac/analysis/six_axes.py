"""The accelerometers of a recording, each by itself and with the same care as a gyro.

A specific force is to its integral, a velocity, what a rate is to an angle: sums, curves and fits
are the same, and only the units differ (`sagnac.units.SENSED`).
"""

from dataclasses import replace

from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Progress, Settings
from sagnac.analysis.still_bench import at_rest
from sagnac.coefficients.estimates import Estimate
from sagnac.recording.model import Recording


def accelerometers_of(
    recording: Recording, settings: Settings, *, progress: Progress | None = None
) -> tuple[Analysis, ...]:
    """An analysis of each accelerometer, its lines out.

    Parameters
    ----------
    recording
        With accelerometers, or without: then there is nothing to do.
    settings
        Interval, confidence and estimators; the gyros that they name do not count, and lines in
        table angle are not sought.
    progress
        Called with the stage and the fraction of it done.

    Raises
    ------
    RecordingError
        If an accelerometer cannot give what `settings` ask for.
    """
    found = []
    for channel in recording.accelerometers:
        name = channel.name
        alone = replace(settings, gyros=(name,), method="none")

        def told(stage: str, fraction: float, name: str = name) -> None:
            if progress is not None:
                progress(f"{name}: {stage}", fraction)

        bench = at_rest(recording.of_accelerometer(name), alone, progress=told)
        found.append(_of_force(bench.analysis))
    return tuple(found)


def _of_force(analysis: Analysis) -> Analysis:
    """The analysis with estimates that know that they are an accelerometer's."""

    def named(estimate: Estimate) -> Estimate:
        return replace(estimate, sensor="accelerometer")

    return replace(
        analysis,
        angle_random_walk=named(analysis.angle_random_walk),
        coefficients={name: named(one) for name, one in analysis.coefficients.items()},
        fits={
            method: replace(
                fit,
                coefficients={name: named(one) for name, one in fit.coefficients.items()},
            )
            for method, fit in analysis.fits.items()
        },
    )
