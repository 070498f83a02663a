"""Reads damaged files in a process of its own, so that a crash of a library is seen and survived.

``python -m tests.fuzz.worker FOLDER SUFFIX SEED FIRST COUNT`` damages FOLDER/sound.SUFFIX.
Each number is written before its file is read and each outcome after it, so that whoever started
this knows which one ended it.
"""

import faulthandler
import resource
import sys
import warnings
from pathlib import Path

import numpy as np

from sagnac.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.recording.quality import check
from tests.fuzz.mutations import MUTATIONS

# Statements that leave much, little and nothing to the file.
STATEMENTS = (
    Statement(),
    Statement(kind="rate", unit="deg/s", sample_rate=100.0),
    Statement(gyros=("x",), time="none", sample_rate=100.0),
)
MEMORY = 6 * 2**30


def damaged(folder: Path, suffix: str, seed: int, number: int) -> Path:
    """The file of a number: always the same bytes."""
    random = np.random.default_rng([seed, number])
    content = (folder / f"sound.{suffix}").read_bytes()
    for _ in range(int(random.integers(1, 4))):
        if content:
            content = MUTATIONS[int(random.integers(len(MUTATIONS)))](content, random)
    path = folder / f"damaged.{suffix}"
    path.write_bytes(content)
    return path


def outcome(path: Path, statement: Statement) -> str:
    """``read``, ``refused``, or what must not be."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            recording = read(path, statement, verify=False)
            check(recording)
    except RecordingError as error:
        said = str(error)
        sound = "\n" not in said and path.name in said and len(said) < 2000
        return "refused" if sound else f"WRONG WORDS {said[:300]!r}"
    except BaseException as error:
        return f"ESCAPED {type(error).__name__}: {str(error)[:300]!r}"
    return "read"


def main(folder: Path, suffix: str, seed: int, first: int, count: int) -> None:
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for number in range(first, first + count):
        print(number, end=" ", flush=True)
        path = damaged(folder, suffix, seed, number)
        print(outcome(path, STATEMENTS[number % len(STATEMENTS)]), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], *(int(argument) for argument in sys.argv[3:]))
