"""The ``sagnac`` command: its parser, and how one run of it ends; no science.

Exit status: 0 done; 1 an error in the data, in one line; 2 wrong usage; 3 the specification is not
kept; 4 the recording does not decide it; 130 interrupted.
What takes time to import is imported by the command that needs it, so that ``--help``
and wrong usage answer at once.
"""

import atexit
import ctypes
import gc
import io
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

from cyclopts import App, CycloptsError, Parameter, UnusedCliTokensError

from sagnac.cli import look, measure, onward, output, simulated
from sagnac.cli.output import DONE, complain
from sagnac.core.errors import ArgumentError, visible
from sagnac.core.version import __version__
from sagnac.core.whole_files import ENDING

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

# Columns below which text does not wrap to anything that is read.
_NARROWEST: Final = 40

app: Final = App(
    name="sagnac",
    version=__version__,
    help="The angle random walk of a gyro, at rest or on a turning table, with an interval.",
    # Lines of a docstring are joined to paragraphs.
    help_format="markdown",
    # A file may be called "[7] run.csv", which is no list in JSON.
    default_parameter=Parameter(
        negative="", show_default=lambda value: value or None, json_list=False
    ),
)
for _command in (*simulated.COMMANDS, *measure.COMMANDS, *look.COMMANDS, *onward.COMMANDS):
    app.command(_command)


def _signal_of(asked: KeyboardInterrupt) -> signal.Signals:
    """The signal that asked the process to end; one that Python raised itself is an interrupt."""
    return signal.Signals(*asked.args or (signal.SIGINT,))


@contextmanager
def stopped_by_signals() -> Iterator[None]:
    """Inside, a signal to end is an exception: as after an interrupt, what is half written goes.

    One that the process was started to ignore, as `nohup` has it, stays ignored.
    """
    known = [number for number in ENDING if signal.getsignal(number) is not signal.SIG_IGN]
    if threading.current_thread() is not threading.main_thread():
        # Only the main thread may ask for signals.
        known = []
    before = {number: signal.signal(number, output.stop) for number in known}
    shown, sys.unraisablehook = sys.unraisablehook, _ask_again
    output.asked.clear()
    try:
        yield
        output.go_on()
    except Exception:
        # A library may make another error of what a signal has raised.
        output.go_on()
        raise
    finally:
        sys.unraisablehook = shown
        for number, handler in before.items():
            signal.signal(number, handler)


def _ask_again(lost: "sys.UnraisableHookArgs") -> None:
    """Send a signal anew whose exception was born where it cannot rise, in a library's callback."""
    if not isinstance(lost.exc_value, KeyboardInterrupt):
        sys.__unraisablehook__(lost)
        return
    again = threading.Timer(0.02, os.kill, (os.getpid(), _signal_of(lost.exc_value)))
    again.daemon = True
    try:
        again.start()
    except KeyboardInterrupt:
        # On a busy machine the time is over before the thread is known to run.
        _ask_again(lost)


class _Unread(io.FileIO):
    """The end of a stream that may have no reader or no room: what comes after goes nowhere.

    If a reader leaves, a command ends its files, and with the status of its verdict, all the same.
    """

    def write(self, data: "ReadableBuffer", /) -> Any:
        """Write bytes."""
        try:
            return super().write(data)
        except OSError as error:
            # Nor does what is still held back fail once more as the interpreter ends.
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            # If standard error, 2, is full there is nowhere to say so.
            if not isinstance(error, BrokenPipeError) and self.fileno() != 2:
                error.filename = "standard output"
                raise
            return super().write(data)


def _going_on(stream: TextIO | None) -> TextIO:
    """A stream of the process that survives its reader; another one as it is."""
    if stream is None:
        # It was closed before the start; what goes there goes nowhere.
        return io.TextIOWrapper(io.FileIO(os.devnull, "w"), encoding="utf-8")
    buffer = getattr(stream, "buffer", None)
    is_own = type(getattr(buffer, "raw", buffer)) is io.FileIO
    if not (is_own and isinstance(stream, io.TextIOWrapper)):
        return stream
    stream.flush()
    end = _Unread(stream.fileno(), "w", closefd=False)
    # Without a buffer (python -u) nothing is held back here either.
    held = end if type(buffer) is io.FileIO else io.BufferedWriter(end)
    going_on = io.TextIOWrapper(held, encoding=stream.encoding, errors=stream.errors)
    going_on.reconfigure(line_buffering=stream.line_buffering, write_through=stream.write_through)
    return going_on


class _Visible(io.TextIOBase):
    """A stream that shows the marks which a terminal would obey."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write a text, made visible."""
        return self._stream.write(visible(text))

    def flush(self) -> None:
        """Flush the stream."""
        self._stream.flush()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments
        Without the program's name; those of the process by default.

    Returns
    -------
    int
        Exit status.
    """
    tokens = list(sys.argv[1:] if arguments is None else arguments)
    try:
        _prepare_process()
        command, bound, _ = app.parse_args(tokens, exit_on_error=False, print_error=False)
        # Names that come from files and paths move no cursor; what the parser shows is its own.
        is_ours = command.__module__.startswith("sagnac.")
        with stopped_by_signals(), redirect_stdout(_Visible(sys.stdout) if is_ours else sys.stdout):
            status = command(*bound.args, **bound.kwargs)
        sys.stdout.flush()
    except KeyboardInterrupt as asked:
        number = _signal_of(asked)
        complain("interrupted" if number == signal.SIGINT else f"stopped by {number.name}")
        # Raised inside of exec, as a dataclass is made, it would end `python -m` as by SIGINT,
        # whatever came: Python notes it there, and forgets it at the next one.
        exec("")
        return 128 + number
    except CycloptsError as error:
        line = _in_several_files(error) or str(error).rstrip()
        end = "" if line.endswith((".", "?")) else "."
        complain(f"{line}{end} See {' '.join(['sagnac', *(error.command_chain or ())])} --help")
        return output.USAGE_ERROR
    except Exception as error:
        if "--debug" in tokens:
            raise
        # Of no other error are options named, and there may be no command: --help > /dev/full.
        of_argument = isinstance(error, ArgumentError)
        return output.explain(error, options_of(tokens[0]) if of_argument else ())
    return status if isinstance(status, int) else DONE


def options_of(command: str) -> set[str]:
    """Options of a command as they are typed; none if there is no command of that name."""
    if command not in app:
        return set()
    arguments = app[command].assemble_argument_collection(default_parameter=app.default_parameter)
    return {name for one in arguments for name in one.names if name.startswith("-")}


def _in_several_files(error: CycloptsError) -> str:
    """A remedy for several files where one is read at a time; empty if it is another error."""
    if not isinstance(error, UnusedCliTokensError) or not error.unused_tokens:
        return ""
    from sagnac.formats.registry import MINISEED

    further = Path(error.unused_tokens[0])
    if further.suffix.lower() in MINISEED.suffixes:
        problem = "channels that stand in a miniSEED file each are put together first"
        remedy = f"{problem}: cat x.mseed y.mseed z.mseed > xyz.mseed"
    elif os.path.exists(further):
        remedy = "many go into a table with sagnac campaign FILE... -o DIR"
    else:
        return ""
    return f"{further}: one recording is read at a time; {remedy}"


def _prepare_process() -> None:
    """Threads of linear algebra, garbage, streams, and the signs that a terminal may lack."""
    # Imports make hundreds of thousands of objects that stay. Going through them every few hundred
    # new ones takes a twentieth of an analysis, every million none of it; large arrays are freed
    # without that.
    gc.set_threshold(1_000_000)
    # Nor are they looked through as the process ends, which takes half a second.
    atexit.register(gc.freeze)
    # The process would keep the memory of freed arrays, up to twice the largest below 32 MiB. An
    # array of two hours has 27 MiB: from 16 MiB on arrays go back to the system at once. To glibc,
    # -1 is M_TRIM_THRESHOLD and -3 is M_MMAP_THRESHOLD.
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    if mallopt:
        mallopt(-1, 16 << 20)
        mallopt(-3, 16 << 20)
    # The fits are thousands of small factorizations. Several threads of linear algebra only slow
    # them down, tenfold if other work shares the cores. numpy reads these at its first import.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("MKL_NUM_THREADS", "1")
    # Figures become files: whatever window the surroundings name is not asked for.
    os.environ["MPLBACKEND"] = "agg"
    if not sys.warnoptions:
        # Libraries warn those who program with them; -W and PYTHONWARNINGS show it.
        warnings.showwarning = lambda *_, **__: None
    sys.stdout, sys.stderr = _going_on(sys.stdout), _going_on(sys.stderr)
    # Help in a column of a few letters never ends.
    if os.environ.get("COLUMNS", "").isdigit() and int(os.environ["COLUMNS"]) < _NARROWEST:
        os.environ["COLUMNS"] = str(_NARROWEST)
    for stream in (sys.stdout, sys.stderr):
        # A terminal that lacks ″ or √ shows a ? there rather than failing.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
