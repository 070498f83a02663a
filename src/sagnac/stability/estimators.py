"""The Allan family: what each estimator is."""

from typing import Final, Literal, get_args

Estimator = Literal[
    "adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev", "mtotdev", "theo1", "theoh", "haar"
]
Gaps = Literal["reject", "omit"]


def check_choice(name: str, value: object, allowed: object) -> None:
    """Refuse a value that is not one of the choices."""
    choices = get_args(allowed)
    if value not in choices:
        raise ValueError(f"{name} {value!r} is not known; use one of {', '.join(choices)}")


THEO1_EFFECTIVE: Final = 0.75
DIFFERENCES: Final[dict[Estimator, int]] = {
    name: 3 if name in ("hdev", "ohdev") else 2 for name in get_args(Estimator)
}
FINITE_DIFFERENCE: Final = ("adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "haar")
WHOLE_RECORD_ONLY: Final = ("totdev", "mtotdev", "theo1", "theoh")
