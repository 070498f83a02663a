"""Reads damaged files in a process of its own, so that a crash of a library is seen and survived.

``python -m tests.fuzz.worker FOLDER ENDING SEED FIRST COUNT`` damages FOLDER/sound.ENDING.
Each number is written before its file is read and each outcome after it, so that whoever started
this knows which one ended it.
"""

import faulthandler
import os
import resource
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.quality.check import check
from sagnac.recording.model import Recording
from tests.fuzz.mutations import MUTATIONS

# Statements that leave much, little and nothing to the file.
STATEMENTS = (
    Statement(),
    Statement(kind="rate", unit="deg/s", sample_rate=100.0),
    Statement(gyros=("x",), time="none", sample_rate=100.0),
)
_RATE = Statement(kind="rate")
_TELEGRAMS = {
    "fields": [["n", "u4"], ["x", "i4", "0.1arcsec"]],
    "byte_order": "big",
    "header_bytes": 6,
    "sync": "aa55",
    "checksum": "crc32",
    "kind": "increment",
    "sample_rate": 200.0,
}
_RING = {"columns": {"z": "BW_RLAS__B_J_Z"}, "kind": "rate", "scale": "2e-9rad/s"}
# Those of files that do not state all, or not in deg/s at 100 Hz.
STATEMENTS_OF = {
    "imu": STATEMENTS[::2],
    "npy": (Statement(columns={"x": "1", "z": "2"}, kind="rate", unit="deg/s", sample_rate=100.0),),
    **dict.fromkeys(
        ("bag", "mcap", "db3", "ulg", "nc", "classic.nc", "euroc.csv", "kalibr.csv"),
        (Statement(), Statement(gyros=("x",), time="none", sample_rate=100.0)),
    ),
    "tdms": (_RATE, Statement(kind="rate", gyros=("z",), span=(0.1, None))),
    "lvm": (_RATE, Statement(kind="rate", gyros=("x",), time="none", sample_rate=100.0)),
    **dict.fromkeys(
        ("mseed", "v2.mseed"),
        (Statement(**_RING), Statement(time="none", sample_rate=200.0, **_RING)),
    ),
    "v73.mat": (Statement(kind="rate", unit="rad/s", sample_rate=200.0),),
    "bin": (Statement(layout=_TELEGRAMS),),
    "ins": (Statement(layout="imu7-deg"), Statement(layout="imu7-rad", gyros=("y",))),
}
# Each sample of these lies under a checksum: none may be read that was not there.
PROVEN = frozenset({"npz", "bin", "mseed"})
# Nothing in these states how many records there are: the first ones are a file as well.
OPEN_ENDED = frozenset({"bin"})
MEMORY = 6 * 2**30


def statement_of(ending: str, number: int) -> Statement:
    """What is stated of the file of a number."""
    choice = STATEMENTS_OF.get(ending, STATEMENTS)
    return choice[number % len(choice)]


def damaged(folder: Path, ending: str, seed: int, number: int) -> Path:
    """The file of a number: always the same bytes, and what the TOML beside it states."""
    random = np.random.default_rng([seed, number])
    content = (folder / f"sound.{ending}").read_bytes()
    for _ in range(int(random.integers(1, 4))):
        if content:
            content = MUTATIONS[int(random.integers(len(MUTATIONS)))](content, random)
    path = folder / f"damaged.{ending}"
    path.write_bytes(content)
    stated = folder / f"sound.{ending}.toml"
    if stated.exists():
        (folder / f"{path.name}.toml").write_bytes(stated.read_bytes())
    return path


def outcome(
    path: Path,
    statement: Statement,
    sound: Recording | None = None,
    *,
    is_proven: bool = False,
    is_open_ended: bool = False,
) -> str:
    """``read``, ``refused``, or what must not be.

    If `sound`, what the sound file holds, is given: ``noted`` if the recording is another and notes
    say so, and ``changed`` if none does. If `is_proven`, no number may be read that was not there.
    If `is_open_ended`, the beginning of the sound file is sound.
    """
    before = set(path.parent.iterdir())
    with tempfile.TemporaryFile() as held:
        with _printed(held):
            said, recording = _outcome(path, statement)
        os.lseek(held.fileno(), 0, os.SEEK_SET)
        printed = held.read(300)
    left = sorted(one.name for one in set(path.parent.iterdir()) ^ before)
    if left:
        return f"LEFT {left}"
    if printed:
        return f"PRINTED {printed!r} {said}"
    if recording is not None and sound is not None and _differs(recording, sound):
        if is_proven and _invents(recording, sound):
            return "INVENTED numbers under a checksum"
        if is_open_ended and _begins(recording, sound):
            return "read"
        return "noted" if _words(recording) - _words(sound) else "changed"
    return said


def _outcome(path: Path, statement: Statement) -> tuple[str, Recording | None]:
    try:
        recording = silently_read(path, statement)
        _words(recording)
    except RecordingError as error:
        said = str(error)
        sound = "\n" not in said and path.name in said and len(said) < 2000
        return "refused" if sound else f"WRONG WORDS {said[:300]!r}", None
    except BaseException as error:
        return f"ESCAPED {type(error).__name__}: {str(error)[:300]!r}", None
    return "read", recording


def silently_read(path: Path, statement: Statement) -> Recording:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return read(path, statement, verify=False)


def _words(recording: Recording) -> set[str]:
    """All that is noted of a recording."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return {str(note) for note in (*recording.notes, *check(recording))}


def _differs(recording: Recording, sound: Recording) -> bool:
    """Whether a gyro, or when its samples were taken, is another than in the sound file."""
    if [gyro.name for gyro in recording.gyros] != [gyro.name for gyro in sound.gyros]:
        return True
    pairs = [(recording.times, sound.times)]
    pairs += [(own.values, sound.gyro(own.name).values) for own in recording.gyros]
    return recording.sample_rate != sound.sample_rate or any(
        # Both are None if no times are read.
        own is not other and not np.array_equal(own, other, equal_nan=True)
        for own, other in pairs
    )


def _begins(recording: Recording, sound: Recording) -> bool:
    """Whether each gyro has the first samples of the sound file, and no others."""
    return recording.sample_rate == sound.sample_rate and all(
        np.array_equal(own.values, sound.gyro(own.name).values[: own.values.size])
        for own in recording.gyros
    )


def _invents(recording: Recording, sound: Recording) -> bool:
    """Whether a gyro has a sample that it has not in the sound file."""
    return any(
        not np.isin(own.values, sound.gyro(own.name).values).all() for own in recording.gyros
    )


@contextmanager
def _printed(held: IO[bytes]) -> Iterator[None]:
    """What libraries print, in Python or beneath it, goes into a file."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = os.dup(1), os.dup(2)
    try:
        os.dup2(held.fileno(), 1)
        os.dup2(held.fileno(), 2)
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, one in enumerate(kept, start=1):
            os.dup2(one, number)
            os.close(one)


def main(folder: Path, ending: str, seed: int, first: int, count: int) -> None:
    # A descriptor of its own: those of the process are lent while a file is read.
    with os.fdopen(os.dup(2), "w") as errors:
        faulthandler.enable(errors)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        sound: dict[int, Recording] = {}
        choices = len(STATEMENTS_OF.get(ending, STATEMENTS))
        for number in range(choices):
            sound[number] = silently_read(folder / f"sound.{ending}", statement_of(ending, number))
        for number in range(first, first + count):
            print(number, end=" ", flush=True)
            path = damaged(folder, ending, seed, number)
            statement, whole = statement_of(ending, number), sound[number % choices]
            said = outcome(
                path,
                statement,
                whole,
                is_proven=ending in PROVEN,
                is_open_ended=ending in OPEN_ENDED,
            )
            print(said, flush=True)
        faulthandler.disable()


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], *(int(argument) for argument in sys.argv[3:]))
