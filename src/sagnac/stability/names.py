"""Names that a caller chooses from; nothing compiled is imported here."""

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
