"""Each gyro of a triad alone."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from sagnac.analysis.averaged import Headline, levels_of
from sagnac.analysis.evidence import Evidence, Points
from sagnac.core.arrays import FloatArray, differences, every
from sagnac.core.errors import Note, RecordingError
from sagnac.noise.band_models import BandModel
from sagnac.noise.estimates import Fit
from sagnac.noise.three_cornered_hat import Separation, separation_of
from sagnac.noise.whole_band import describes
from sagnac.recording.channel import PAIR_SIZE
from sagnac.spectrum.levels import Levels

# That levels of a difference whose law is right fail each of two tests, as those of the pair may.
_CHANCE: Final = 0.02


def each_alone(evidence: Evidence, headline: Headline) -> Separation:
    """Each gyro's own N, of every sample if five terms describe those of each two gyros.

    Else of the angles of the likelihood fit of the measurement, in its band.

    Parameters
    ----------
    evidence
        Of a triad; nothing is known of each of fewer gyros.
    headline
        The candidate that the data bear out.
    """
    fine, spectrum, fits = evidence.fine, headline.spectrum, evidence.fits
    usual = _hat_of(evidence, fine, fits["likelihood"])
    if not usual.angle_random_walk or spectrum is None or spectrum.points.rate <= fine.rate:
        return usual
    if spectrum.average.rests_on.member != "whole band":
        return usual
    finest = _hat_of(evidence, spectrum.points, spectrum.likelihood, tested=True)
    return finest if finest.angle_random_walk else usual


def _hat_of(evidence: Evidence, points: Points, fit: Fit, *, tested: bool = False) -> Separation:
    """By three-cornered hat, if both searches came to an end and angles are of samples.

    `points` are angles of the measurement, and `fit` is of them: its band is used. If `tested`,
    nothing is given unless the laws describe the spectrum of each difference.
    """
    settings, left, second = evidence.settings, evidence.left, evidence.remainders[-1]
    finished = second is not left and left.is_finished and second.is_finished
    # A gyro that does not count in its pair is not told apart.
    are_apart = finished and all(left.weights) and all(second.weights)
    if not are_apart or evidence.readout.every is None or left.once_a_turn:
        return Separation(angle_random_walk={})
    first, middle, last = settings.gyros
    step = max(1, round(left.rate / points.rate))
    # A pair whose weights are v and w, over v, is the first gyro less -w/v times the other one.
    (of_last, last_weight), (of_middle, middle_weight) = left.weights, second.weights

    def less_middle() -> FloatArray:
        return differences(every(second.removal.residual, step)) * (PAIR_SIZE / of_middle)

    def less_last() -> FloatArray:
        return differences(every(left.removal.residual, step)) * (PAIR_SIZE / of_last)

    band = (0.0, 0.0 if fit.band is None else fit.band.high)
    masked = left.removal.masked + second.removal.masked
    how: dict[str, Any] = {"band": band, "masked": masked, "confidence": settings.confidence}
    names, steps = (middle, first, last), [-less_middle(), less_last()]
    try:
        separation = separation_of(names, steps, sample_rate=points.rate, **how)
    except RecordingError as error:
        # Vibration in either difference may leave no band to both.
        note = Note(text=f"no angle random walk of each gyro alone: {error}", level="warning")
        return Separation(angle_random_walk={}, notes=(note,))
    # The headline is of the first less the last, which are described.
    pairs: dict[tuple[str, str], Callable[[], FloatArray]] = {
        (first, middle): less_middle,
        (middle, last): lambda: less_last() - less_middle(),
    }
    for pair, of_pair in pairs.items() if tested else ():
        squares = separation.squares[pair[0]] + separation.squares[pair[1]]
        if not _describes(squares, levels_of(of_pair(), points.rate, masked), points.rate):
            return Separation(angle_random_walk={})
    sizes = {first: 1.0, middle: of_middle / middle_weight, last: of_last / last_weight}
    own = {}
    for name in settings.gyros:
        one = separation.angle_random_walk[name]
        value, low, high = (abs(sizes[name]) * end for end in (one.value, one.low, one.high))
        own[name] = replace(one, value=value, low=low, high=high)
    return replace(separation, angle_random_walk=own)


def _describes(squares: FloatArray, levels: Levels | None, rate: float) -> bool:
    """Whether squared Q, N, B and K of increments at a rate, Hz, describe their levels."""
    if levels is None:
        return False
    law = BandModel(squares=tuple(squares.tolist()), interval=1.0 / rate)
    freedom = levels.level.size - squares.size
    return describes(levels.shape, law.over(levels), freedom, _CHANCE)
