"""Read and write by the format of the file: one table, `sagnac.formats.registry`, says which."""

import hashlib
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import Any, Final, Unpack

from sagnac.core.errors import MissingExtra, RecordingError, path_of, require_choice
from sagnac.core.overwriting import require_free
from sagnac.formats import statement as stating
from sagnac.formats.assemble import assemble
from sagnac.formats.files import about, damaged
from sagnac.formats.registry import BINARY, CSV, EUROC_DATA, ROSBAG, Format, formats
from sagnac.formats.source import Outgoing, Source, outgoing
from sagnac.formats.statement import Statement, StatementFields, Statements
from sagnac.formats.suggestion import accelerometer_inputs, candidates, column_text, suggestion
from sagnac.recording.model import Provenance, Recording, require_recording

_AXES: Final = 3
# The first bytes of a file that stands for one of Git LFS.
_POINTER: Final = b"version https://git-lfs"


def read(
    path: Path | str,
    statement: Statement | None = None,
    *,
    verify: bool = True,
    **stated: Unpack[StatementFields],
) -> Recording:
    """Read a recording.

    Parameters
    ----------
    path
        The file; its suffix says the format.
    statement
        What the caller states. It overrides a TOML beside the file, which overrides the file.
    verify
        Refuse data that are not sound (`sagnac.quality.check.integrity`). Without, they come
        as they are, for `sagnac.quality.check.check`.
    **stated
        The fields of a `sagnac.formats.Statement`, by name, in place of `statement`: ``gyros``,
        ``accelerometers``, ``kind``, ``unit``, ``scale``, ``sample_rate``, ``time``, ``table``,
        ``columns``, ``span``, ``counter_bits``, ``counter_period``, ``null_pulse``, ``layout``.

    Returns
    -------
    recording
        In SI, with the file's SHA-256 and every note.

    Raises
    ------
    RecordingError
        If the file cannot be read, or does not state what it has to, or is not sound: the file,
        the channel, what is wrong and what to do.
    MissingExtra
        If the format needs a library that is not installed.
    ValueError
        If a value that is stated cannot be, or `statement` is given beside `stated`.
    TypeError
        If `path` is no path, or `stated` has a name that is no field of a statement; the message
        lists those there are.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "bench.csv"
    ...     _ = path.write_text("x\\n" + "".join(f"{n % 7}\\n" for n in range(100)))
    ...     recording = read(path, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> recording.gyros, recording.duration
    ((Channel(x: 100 samples, rate, shown in deg/h),), 10.0)
    """
    require_choice("verify", verify, (False, True))
    source, statements = _opened(path, statement, stated)
    path = _file_of(path)
    with about(path), ThreadPoolExecutor(max_workers=1) as pool:
        # Hashing needs no lock of the interpreter: it runs while the columns are parsed.
        digest = pool.submit(_sha256, path)

        def origin() -> Provenance:
            return Provenance(path=str(path), sha256=digest.result(), format=source.format)

        return assemble(source, statements, origin, verify=verify)


def columns(path: Path | str) -> tuple[str, ...]:
    """Names of the numeric columns of a file, as it writes them.

    Raises
    ------
    RecordingError
        If the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "bench.csv"
    ...     _ = path.write_text("t[s],x[deg/h]\\n0.0,1.5\\n")
    ...     columns(path)
    ('t[s]', 'x[deg/h]')
    """
    path = _file_of(path)
    with about(path):
        return tuple(column.key for column in _open(path, Statements()).columns)


def missing(
    path: Path | str, statement: Statement | None = None, **stated: Unpack[StatementFields]
) -> dict[str, str]:
    """Statements that a file still needs to be read: guesses, and what no file tells.

    Parameters
    ----------
    path, statement, **stated
        See `read`.

    Returns
    -------
    dict of str
        Input -> value, as the command line takes them. A word in capitals stands for what cannot
        be guessed. Empty if nothing is missing.

    Raises
    ------
    RecordingError
        If the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "bench.csv"
    ...     _ = path.write_text("stamp,gyro_x[deg/s]\\n" + "0.00,1.5\\n0.01,1.6\\n" * 4)
    ...     missing(path)
    {'columns': 'x=gyro_x[deg/s]', 'kind': 'rate', 'time': 'stamp:s'}
    """
    with about(_file_of(path)):
        return suggestion(*_opened(path, statement, stated))


def gyros_in(path: Path | str, statement: Statement | None = None) -> tuple[str, ...]:
    """Columns of a file that may be gyros, if nothing says which of them are.

    Parameters
    ----------
    path, statement
        See `read`.

    Returns
    -------
    tuple of str
        As ``columns`` takes them.

    Raises
    ------
    RecordingError
        If the file cannot be read.
    """
    return tuple(map(column_text, candidates(*_opened(path, statement, {}))))


def accelerometers_in(path: Path | str, statement: Statement) -> dict[str, str]:
    """Statements that the accelerometers of a file still need to be read as well.

    Parameters
    ----------
    path, statement
        See `read`.

    Returns
    -------
    dict of str
        Input -> value, as of `missing`; to be put beside what is stated of the gyros. Empty if
        the file seems to have none, or if they are read already.

    Raises
    ------
    RecordingError
        If the file cannot be read.
    """
    return accelerometer_inputs(*_opened(path, statement, {}))


def _opened(
    path: Path | str, statement: Statement | None, stated: Mapping[str, Any]
) -> tuple[Source, Statements]:
    """A file with the notes on it and on the TOML beside it, and the statements about it."""
    path, caller = _file_of(path), stating.one_statement(statement, stated)
    with about(path):
        by_toml, notes = stating.beside(path)
        source = _open(path, Statements(caller=caller, beside=by_toml))
    statements = Statements(caller=caller, beside=by_toml, file=source.stated)
    return replace(source, notes=(*source.notes, *notes)), statements


def write(recording: Recording, path: Path | str, *, force: bool = False) -> Path:
    """Write a recording in the format that the suffix names.

    `read` needs no option for it, except for a temperature, which no name makes one: state
    ``columns={"temperature": "temperature"}``. Values are in the unit they came in if that is a
    plain one, else in arcsec, deg/h and, for the table, deg. A CSV gets a TOML beside it for kind
    and rate.

    Parameters
    ----------
    recording
        What is written.
    path
        Its suffix says the format. A recording that this package wrote is replaced.
    force
        Replace any other file, too.

    Returns
    -------
    path
        The file written; it appears only when it is whole.

    Raises
    ------
    RecordingError
        If the format is not known or the file cannot be written.
    WouldOverwrite
        If another file is there, and `force` is not set.
    ValueError
        If a gyro has a name that cannot stand in a file.

    Examples
    --------
    >>> import numpy as np
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> rate = np.random.default_rng(1).standard_normal(1000)
    >>> still = Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> with TemporaryDirectory() as place:
    ...     path = write(still, Path(place) / "still.parquet")
    ...     back = read(path)
    >>> path.name, back.samples, back.sample_rate
    ('still.parquet', 1000, 10.0)
    """
    require_recording(recording)
    path = path_of("path", path)
    out = outgoing(recording)
    known = format_to_write(path, out)
    with about(path):
        require_free(stating.of_conversion(path), force=force)
        _module(known, "writing").write(path, out)
    return path


def format_to_write(path: Path, heading: Outgoing) -> Format:
    """The format that a suffix names, if it can hold a recording.

    Parameters
    ----------
    path
        The file to write.
    heading
        Columns of the recording, and their kinds.

    Raises
    ------
    RecordingError
        If no format has the suffix, it cannot hold that, or a TOML beside the file would be
        believed instead of it.
    MissingExtra
        If the format needs a library that is not installed.
    """
    suffix = path.suffix.lower()
    known = next((one for one in formats() if one.writes and suffix in one.suffixes), None)
    if known is None:
        suffixes = ", ".join(own for one in formats() if one.writes for own in one.suffixes)
        remedy = f"use one of {suffixes}"
        raise RecordingError("no format to write has this suffix", path=str(path), remedy=remedy)
    if known is not CSV and stating.beside(path)[0] != Statement():
        how = "how a file of this name is to be read"
        problem = f"a TOML beside it states {how}, and would be believed"
        remedy = "remove the TOML, or choose another output"
        raise RecordingError(problem, path=str(path), remedy=remedy)
    kinds, gyros, forces = heading.kinds, len(heading.gyros), len(heading.accelerometers)
    wrong = [name for name in heading.units if name not in (*kinds, "time")]
    wrong += [f"{name} of kind {kind}" for name, kind in kinds.items() if kind != "rate"]
    if gyros != _AXES or len(kinds) not in known.rates_of:
        wrong.append(f"{gyros} gyros with {forces} accelerometers")
    if known.rates_of and wrong:
        alone = " or none" if _AXES in known.rates_of else ""
        problem = f"{known.name} holds rates of three gyros and three accelerometers{alone}"
        problem += f", and cannot hold {', '.join(wrong)}"
        remedy = "give what it holds, or use .parquet, which holds every recording"
        raise RecordingError(problem, path=str(path), remedy=remedy)
    with about(path):
        # A library that is not installed is named before there is anything to write.
        _module(known, "writing")
    return known


def _file_of(path: Path | str) -> Path:
    """The file that is read: of a folder of EuRoC the samples of its IMU."""
    path = path_of("path", path)
    inside = path / EUROC_DATA
    return inside if inside.is_file() else path


def _open(path: Path, statements: Statements) -> Source:
    layout = statements.first("layout")
    if path.is_dir() and (path / "metadata.yaml").is_file():
        # A bag of ROS 2 is a folder.
        known, layout = ROSBAG, None
    else:
        beginning = _beginning(path)
        known = BINARY if layout is not None and beginning else format_of(path.suffix, beginning)
    module, declared = _module(known, "reading"), () if layout is None else (layout,)
    with damaged(known.name):
        source: Source = module.open_source(path, *declared)
    return replace(source, format=source.format or known.name)


def _beginning(path: Path) -> bytes:
    """The first bytes of a file.

    Raises
    ------
    RecordingError
        If it is no file that is stored whole, or cannot be opened.
    """
    if path.is_dir():
        problem = f"is a folder without {EUROC_DATA} (EuRoC) or metadata.yaml (ROS 2)"
        raise RecordingError(problem, remedy="give a file, or a folder of one of these kinds")
    if path.exists() and not path.is_file():
        problem = "cannot be opened: it is no regular file"
        raise RecordingError(problem, remedy="give a file that is stored whole")
    try:
        with path.open("rb") as stream:
            beginning = stream.read(len(_POINTER))
    except OSError as error:
        why = f"cannot be opened ({error.strerror})"
        is_missing = isinstance(error, FileNotFoundError)
        remedy = "check the path" if is_missing else "check the path and its permissions"
        raise RecordingError("no such file" if is_missing else why, remedy=remedy) from None
    if beginning == _POINTER:
        problem = "is a pointer of Git LFS: the content was not fetched"
        raise RecordingError(problem, remedy="fetch it: git lfs pull")
    if beginning and not path.stat().st_size:
        problem = "is made by the system as it is read, and states no size"
        raise RecordingError(problem, remedy="copy it, and give the copy")
    return beginning


def format_of(suffix: str, beginning: bytes) -> Format:
    """The format of a file.

    Parameters
    ----------
    suffix
        Of its name, with the dot.
    beginning
        Its first bytes; they rule where a format is known by them.

    Raises
    ------
    RecordingError
        If there is none, the file is empty, or the bytes contradict the suffix.

    Examples
    --------
    >>> format_of(".pq", b"PAR1...").name
    'Parquet'
    """
    suffix = suffix.lower()
    by_suffix = next((one for one in formats() if suffix in one.suffixes), None)
    if by_suffix is None:
        suffixes = ", ".join(dict.fromkeys(own for one in formats() for own in one.suffixes))
        remedy = f"unpack it, or convert it to one of {suffixes}"
        raise RecordingError("no format has this suffix", remedy=remedy)
    if not beginning:
        raise RecordingError("is empty", remedy="get the file again from its source")
    for known in chain([by_suffix], formats()):
        if known.beginning and beginning.startswith(known.beginning):
            if suffix in (*known.suffixes, *known.also):
                return known
            remedy = f"rename it to end in {known.suffixes[0]}"
            raise RecordingError(f"is {known.name}, not what its suffix claims", remedy=remedy)
    return by_suffix


def _module(known: Format, doing: str) -> Any:
    """The module of a format; its library is loaded only now."""
    name = known.module if "." in known.module else f"sagnac.formats.{known.module}"
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if known.extra:
            raise MissingExtra(f"{doing} {known.name}", package, known.extra) from error
        problem = f"{doing} {known.name} needs {error.name}, which is not installed"
        raise RecordingError(problem, remedy=f"install it: pip install {package}") from error


def _sha256(path: Path) -> str:
    """Digest of a file, or of the files of a folder in the order of their names."""
    if not path.is_dir():
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    digest = hashlib.sha256()
    for one in sorted(part for part in path.iterdir() if part.is_file()):
        with one.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()
