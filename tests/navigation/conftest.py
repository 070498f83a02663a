"""What the tests of files for other tools share."""

import pytest

from sagnac.navigation.models import common_time


@pytest.fixture(autouse=True, scope="session")
def same_limits_have_one_time():
    """The time of a Markov rate takes a tenth of a second; many files are of the same limits."""
    times: dict[tuple[bytes, ...], float] = {}

    def once(limits):
        arrays = [(one.tau, one.limit, one.beyond) for one in limits]
        key = tuple(part.tobytes() for one in arrays for part in one)
        if key not in times:
            times[key] = common_time(limits)
        return times[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sagnac.navigation.tools.common_time", once)
        yield
