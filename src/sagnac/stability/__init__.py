"""Stability against cluster time: the Allan family, its noise types and degrees of freedom.

Modules, low to high: `sums` (samples to angle, and how estimators sum its differences), `freedom`
(degrees of freedom), `estimators` (the one table of what each estimator is), `noise_type`
(clusters, noise and degrees of freedom by that table), `curve` (all of it).
What a caller chooses from stands here, where nothing compiled is imported.
"""

from typing import Literal, get_args

Estimator = Literal[
    "adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev", "mtotdev", "theo1", "theoh", "haar"
]
Gaps = Literal["reject", "omit"]


def check_choice(name: str, value: object, allowed: object) -> None:
    """Refuse a value that is not one of the choices.

    Parameters
    ----------
    name
        Of the argument, for the message.
    value
        What was given.
    allowed
        The `Literal` it has to be of.

    Raises
    ------
    ValueError
        With the argument, the value and the choices.
    """
    choices = get_args(allowed)
    if value not in choices:
        raise ValueError(f"{name} {value!r} is not known; use one of {', '.join(choices)}")
