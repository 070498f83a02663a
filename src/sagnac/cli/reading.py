"""A recording that a command reads: its progress, its time, and its name in what goes wrong."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import sagnac
from sagnac.cli.options import Reading, statement_of
from sagnac.cli.output import Progress, progress_shown


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadFile:
    """A recording that was read.

    Attributes
    ----------
    recording
        What the file holds.
    seconds
        Time that reading took, s by stage.
    progress
        Called with the stage of what is done with it, and the fraction done.
    """

    recording: "sagnac.Recording"
    seconds: dict[str, float]
    progress: Progress

    def analyzed(
        self, settings: "sagnac.Settings", progress: Progress | None = None
    ) -> "sagnac.Analysis":
        """The analysis, with the time of reading."""
        analysis = sagnac.analyze(self.recording, settings, progress=progress or self.progress)
        return analysis.with_seconds(self.seconds)


@contextmanager
def reading(
    file: Path, options: Reading, *, verify: bool = True, prefix: str = ""
) -> Iterator[ReadFile]:
    """A recording; inside, progress is shown, and an error in the data names the file.

    What a fit or a factorization cannot do with numbers is a fault of the data, too; the error says
    which numbers they are.

    Parameters
    ----------
    file
        Path of it.
    options
        What is stated of it, and how much memory it may take.
    verify
        Refuse data that are not sound.
    prefix
        Goes before each stage of progress.

    Raises
    ------
    RecordingError
        If the file cannot be read or is not sound, or what is done inside fails on its numbers.
    """
    from sagnac.formats.files import USUAL, limited

    statement, began = statement_of(options), time.perf_counter()
    with progress_shown(prefix) as progress:
        progress("read", 0.0)
        with limited(options.memory or USUAL):
            recording = sagnac.read(file, statement, verify=verify)
        progress("read", 1.0)
        seconds = {"read": time.perf_counter() - began}
        try:
            yield ReadFile(recording=recording, seconds=seconds, progress=progress)
        except (sagnac.RecordingError, sagnac.MissingExtra) as error:
            raise error.at(str(file)) from error
        except (ValueError, ArithmeticError) as error:
            # numpy's LinAlgError is a ValueError.
            said = f"the analysis fails ({error}) on {_numbers(recording)}"
            remedy = "look at the data with sagnac check"
            raise sagnac.RecordingError(said, path=str(file), remedy=remedy) from error


def _numbers(recording: "sagnac.Recording") -> str:
    """The samples of each channel in one line: how many, and between which values they lie."""
    said = []
    for channel in (*recording.gyros, *recording.accelerometers):
        unit, values = channel.plain_unit, channel.values
        ends = f"{values.min() / unit.size:.4g} to {values.max() / unit.size:.4g}"
        said.append(f"{channel.name}: {values.size} samples from {ends} {unit.name}")
    return ", ".join(said)
