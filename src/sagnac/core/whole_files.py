"""Files and folders that appear only when they are whole: written beside, then renamed."""

import ctypes
import glob
import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from sagnac.core.errors import RecordingError

# What is being written ends so, and begins with as much of the name as leaves room for the rest.
_PART: Final = ".part"
_LONGEST: Final = 180
# Signals that end a run.
ENDING: Final = {one for one in signal.Signals if one.name in ("SIGINT", "SIGTERM", "SIGHUP")}


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path, in a folder beside `path`, that becomes `path` if all goes well.

    The folder's name holds the number of this process; what processes that have died left goes.

    Raises
    ------
    RecordingError
        If the folder cannot be written to, or the disk is full.
    """
    with replacing_set(path) as folder:
        yield folder / path.name


def write_text(path: Path, text: str) -> None:
    """Write a text, whole or not at all.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    # A name that the system's encoding did not read is its bytes, of UTF-8 in most cases.
    write_bytes(path, text.encode(errors="surrogateescape").decode(errors="replace").encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write bytes, whole or not at all.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def _part_of(path: Path, becomes: Path) -> Iterator[Path]:
    """A temporary folder beside `path` that goes in the end.

    Parameters
    ----------
    path
        What it is to be.
    becomes
        Folder that its files go to: what is wrong with one of them is told of the file that it
        becomes.

    Raises
    ------
    RecordingError
        If it cannot be written to, or the disk is full.
    """
    temporary: Path | None = None
    try:
        # A signal between the folder and its name here would leave it.
        with _signals_waiting():
            remove_leftovers(path)
            prefix = f".{path.name[:_LONGEST]}.{os.getpid()}."
            temporary = Path(tempfile.mkdtemp(prefix=prefix, suffix=_PART, dir=path.parent))
        yield temporary
    except OSError as error:
        raise _unwritable(path, error) from error
    except RecordingError as error:
        if temporary is not None and Path(error.path).is_relative_to(temporary):
            error.path = str(becomes / Path(error.path).relative_to(temporary))
        raise
    finally:
        with _signals_waiting():
            if temporary is not None:
                _remove(temporary)


def _remove(part: Path) -> None:
    if part.is_dir() and not part.is_symlink():
        shutil.rmtree(part, ignore_errors=True)
    else:
        part.unlink(missing_ok=True)


@contextmanager
def replacing_set(path: Path) -> Iterator[Path]:
    """A temporary folder whose files become `path` and those that go with it if all goes well.

    The names of two files cannot change at once. So the old files beside go before `path` changes,
    and the new ones come after it: a process that is killed meanwhile leaves a file without those
    beside, never with those of another. Signals wait so long.

    Parameters
    ----------
    path
        The file that the others go with; the folder has one of its name in the end.

    Raises
    ------
    RecordingError
        If it cannot be written to, or the disk is full.
    """
    with _part_of(path, path.parent) as folder:
        yield folder
        names = [entry.name for entry in folder.iterdir() if entry.name != path.name]
        with _signals_waiting():
            for name in names:
                path.with_name(name).unlink(missing_ok=True)
            for name in (path.name, *names):
                _put(folder / name, path.with_name(name))


@contextmanager
def _signals_waiting() -> Iterator[None]:
    """Let signals that end a run come after this.

    A mask would not do: what is masked in this thread the system gives to another one, and Python
    runs the handler in this thread all the same.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    handlers = {number: signal.getsignal(number) for number in ENDING}
    try:
        for number in handlers:
            signal.signal(number, lambda number, _: came.append(number))
        yield
    finally:
        for number, handler in handlers.items():
            # None: a library set it, and Python cannot set it again.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for one in came:
            signal.raise_signal(one)


@contextmanager
def replacing_folder(folder: Path, earlier: Callable[[], Iterable[Path]] = tuple) -> Iterator[Path]:
    """A temporary folder beside `folder` whose files replace those of it, all at once or none.

    Of the files of an `earlier` run in it those go that have no successor: beside new ones they
    would be believed. They go first, and so do folders that they leave empty. It is asked for them
    when the new ones are whole: another run may have ended since these were begun.

    If `folder` has no other files, the two change places in one step if the system can do that
    (Linux), else one after the other. Other files are neither moved nor copied, since somebody may
    be writing them, and a folder that this process works in keeps its place: the old files go, and
    the new ones come, while signals wait.

    Raises
    ------
    RecordingError
        If it cannot be written to, or the disk is full.
    """
    folder = folder.absolute()
    made(folder.parent)
    with _part_of(folder, folder) as temporary:
        yield temporary
        # A temporary folder is for its maker alone.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o777 & ~mask)
        old = [path.absolute().relative_to(folder) for path in earlier()]
        for name in old:
            if not (temporary / name).exists():
                (folder / name).unlink(missing_ok=True)
        for name in {name.parent for name in old} - {Path()}:
            with suppress(OSError):
                (folder / name).rmdir()
        _put(temporary, folder)


def made(folder: Path) -> Path:
    """The folder, made if it was not there.

    Raises
    ------
    RecordingError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unwritable(folder, error) from None
    return folder


def _put(new: Path, place: Path) -> None:
    """Let a file or a folder take its place; what else a folder there holds stays."""
    if not (new.is_dir() and place.is_dir()):
        os.replace(new, place)
    elif _may_move(place, new):
        _change_places(new, place)
    else:
        _move_into(place, new)


def _may_move(folder: Path, new: Path) -> bool:
    """Whether a folder holds nothing but what is replaced, and no process works in it."""
    here = Path.cwd()
    if folder.is_symlink() or folder in (here, *here.parents):
        return False
    for entry in folder.iterdir():
        other = new / entry.name
        if not other.exists() or other.is_dir() != entry.is_dir():
            return False
        if entry.is_dir() and not _may_move(entry, other):
            return False
    return True


def _move_into(folder: Path, new: Path) -> None:
    """Let the files of a folder take the places of those in another, and its folders theirs."""
    # The document tells whose files these are: it goes last and comes first.
    files = [path.relative_to(new) for path in new.rglob("*") if not path.is_dir()]
    files.sort(key=lambda path: path.suffix != ".json")
    with _signals_waiting():
        for path in reversed(files):
            (folder / path).unlink(missing_ok=True)
        for path in files:
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            os.replace(new / path, folder / path)


def remove_leftovers(path: Path) -> None:
    """Remove what processes that have died left of `path` half written."""
    beginning = f".{path.name[:_LONGEST]}."
    for entry in path.parent.glob(f"{glob.escape(beginning)}*{_PART}"):
        number = entry.name.removeprefix(beginning).partition(".")[0]
        if number.isdigit() and not _is_alive(int(number)):
            _remove(entry)


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (OSError, OverflowError) as error:
        return not isinstance(error, ProcessLookupError)
    return True


def _change_places(one: Path, other: Path) -> None:
    """Let two folders change their names."""
    # renameat2(AT_FDCWD, ..., RENAME_EXCHANGE) of Linux; Python has no name for it.
    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename and rename(-100, os.fsencode(one), -100, os.fsencode(other), 2) == 0:
        return
    aside = one.with_name(f"{one.name}.old{_PART}")
    os.replace(other, aside)
    os.replace(one, other)
    os.replace(aside, one)


def _unwritable(path: Path, error: OSError) -> RecordingError:
    problem = f"cannot be written ({error.strerror or ' '.join(str(error).split())[:160]})"
    return RecordingError(problem, path=str(path), remedy="choose another output")
