"""The server: bound to this machine, behind a token, for its own page only.

Every address begins with the token. A request of another host name, of another origin or with a
wrong token is refused before anything is looked at. Pages hear of their runs by a stream of events,
which browsers open again by themselves after a sleep.
"""

import asyncio
import contextlib
import hmac
import json
import logging
import secrets
import shutil
import socket
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np

import sagnac
from sagnac.app import looks, stated
from sagnac.app.sessions import Room, Session, Sessions, Task, campaign_table

try:
    from tornado import web
    from tornado.httpserver import HTTPServer
    from tornado.iostream import StreamClosedError
except ImportError as error:
    raise sagnac.MissingExtra("the page", "tornado", "app") from error

HOST: Final = "127.0.0.1"
_STATIC: Final = Path(__file__).parent / "static"
_HEADERS: Final = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data: blob:; connect-src 'self'; font-src 'self' data:; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Server": "sagnac",
}
_TYPES: Final = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}


@dataclass(slots=True, kw_only=True, eq=False)
class State:
    """The state that all requests share.

    Attributes
    ----------
    token, port
        Of the address.
    room
        Where files may lie.
    first
        Path of the file to open at once, as the page names it; empty for none.
    """

    token: str
    port: int
    room: Room
    first: str = ""
    sessions: Sessions = field(default_factory=lambda: Sessions(loop=asyncio.get_running_loop()))
    threads: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(4, "sagnac-app"))


class _Handler(web.RequestHandler):
    """A request, after the checks that hold for every one."""

    def initialize(self, state: State) -> None:
        self.state = state

    def set_default_headers(self) -> None:
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        host, token = self.request.host, self.path_args[0].encode()
        origin = self.request.headers.get("Origin")
        site = self.request.headers.get("Sec-Fetch-Site", "none")
        foreign = origin is not None and origin != f"http://{host}"
        refusals = {
            "Another host": host not in (f"{one}:{self.state.port}" for one in (HOST, "localhost")),
            "Another origin": foreign or site not in ("none", "same-origin"),
            "Wrong token": not hmac.compare_digest(token, self.state.token.encode()),
            "No origin": self.request.method == "POST" and origin is None,
        }
        for reason, holds in refusals.items():
            if holds:
                raise web.HTTPError(403, reason=reason)

    def write_error(self, status_code: int, **_: Any) -> None:
        """One line, whatever went wrong."""
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{self._reason}\n")

    def session(self) -> Session:
        """That of the page which asks."""
        name = self.request.headers.get("X-Page") or self.get_query_argument("page", "")
        return self.state.sessions.of(name)


class _File(_Handler):
    """The page, its script and style, and the scripts of the plotting library."""

    def get(self, _token: str, name: str) -> None:
        name = name or "page.html"
        path = _STATIC / name
        if name in ("bokeh.min.js", "bokeh-api.min.js"):
            path = bokeh_scripts() / name
        elif name not in {one.name for one in _STATIC.iterdir()}:
            raise web.HTTPError(404, reason="No such file")
        self.set_header("Content-Type", f"{_TYPES[path.suffix]}; charset=utf-8")
        self.finish(path.read_bytes())


class _Call(_Handler):
    """One question of the page and its answer, both JSON; what is wrong is one line."""

    async def post(self, _token: str, name: str) -> None:
        if name not in _ANSWERS:
            raise web.HTTPError(404, reason="No such question")
        loop = asyncio.get_running_loop()
        found = await loop.run_in_executor(self.state.threads, self._answered, name)
        self.set_header("Content-Type", "application/json; charset=utf-8")
        self.finish(json.dumps(found, allow_nan=False, separators=(",", ":")))

    def _answered(self, name: str) -> dict[str, Any]:
        """An answer, or in one line why there is none."""
        try:
            asked = json.loads(self.request.body or b"{}")
            if not isinstance(asked, dict):
                raise ValueError("a question is a table of its arguments")
            return _ANSWERS[name](self.state, self.session(), asked)
        except (ValueError, TypeError, KeyError, OSError, MemoryError, ImportError) as error:
            return {"error": stated.line(error)}


class _Events(_Handler):
    """Events of the runs of a page, as they happen."""

    async def get(self, _token: str) -> None:
        try:
            session = self.session()
        except ValueError as error:
            raise web.HTTPError(403, reason="No page") from error
        self.set_header("Content-Type", "text/event-stream; charset=utf-8")
        text = "retry: 1000"
        with contextlib.suppress(StreamClosedError), session.listening() as queue:
            while True:
                self.write(f"{text}\n\n")
                await self.flush()
                try:
                    # Seconds between two signs of life, by which a closed page is noticed.
                    event = await asyncio.wait_for(queue.get(), 15.0)
                    text = f"data: {json.dumps(event, allow_nan=False)}"
                except TimeoutError:
                    text = ": beat"


@web.stream_request_body
class _Drop(_Handler):
    """A file that was dropped on the page, written to a folder that goes with the server."""

    def prepare(self) -> None:
        super().prepare()
        name = Path(self.get_query_argument("name", "")).name.lstrip(".")
        if not name or len(name) > 200 or not name.isprintable():
            raise web.HTTPError(400, reason="No name of a file")
        self.session()
        # A recording; any other request has no more than a megabyte.
        connection: Any = self.request.connection
        connection.set_max_body_size(8 * 2**30)
        self.folder = Path(tempfile.mkdtemp(dir=self.state.room.dropped))
        self.file = (self.folder / name).open("wb")

    def data_received(self, chunk: bytes) -> None:
        self.file.write(chunk)

    def post(self, _token: str) -> None:
        self.file.close()
        self.finish({"path": self.file.name})

    def on_connection_close(self) -> None:
        self.file.close()
        shutil.rmtree(self.folder, ignore_errors=True)


Answer = Callable[[State, Session, dict[str, Any]], dict[str, Any]]


def _open(state: State, session: Session, asked: dict[str, Any]) -> dict[str, Any]:
    texts = stated.cleaned(asked["texts"], stated.READING)
    look = looks.look(state.room.path(asked["path"]), texts)
    return {"look": session.keep(look), **looks.facts(look)}


def _window(state: State, session: Session, asked: dict[str, Any]) -> dict[str, Any]:
    look = session.looks[asked["look"]]
    span = float(asked["start"]), float(asked["stop"])
    return {"channels": looks.window(look, *span, int(asked["pixels"]))}


def _task(state: State, asked: dict[str, Any]) -> Task:
    """What is to be analyzed; a wrong value is told before a process is started."""
    reading = stated.cleaned(asked["texts"], stated.READING)
    analysis = stated.cleaned(asked["analysis"], stated.ANALYSIS)
    sagnac.Statement(**stated.reads(reading, analysis))
    sagnac.Settings(**stated.choices(analysis))
    return Task(path=state.room.path(asked["path"]), reading=reading, analysis=analysis)


def _analyze(state: State, session: Session, asked: dict[str, Any]) -> dict[str, Any]:
    task, look = _task(state, asked), session.looks.get(asked.get("look", 0))
    # The answer would be of another recording than the trace above it.
    if look and looks.stamp_of(task.path) not in (None, look.stamp):
        problem = f"{task.path} has changed since it was read"
        raise ValueError(f"{problem}; click “Read it like this”, look again, then analyze")
    return {"run": session.start(task)}


def _repeat(state: State, session: Session, asked: dict[str, Any]) -> dict[str, Any]:
    task, changed = _task(state, asked), asked.get("changed")
    named = task.path.name if state.room.dropped in task.path.parents else str(task.path)
    remark, stated_so = stated.remark(changed), (task.reading, task.analysis)
    command, toml = remark + stated.command(named, *stated_so), remark + stated.toml(*stated_so)
    return {"command": command, "script": stated.script(named, *stated_so, changed), "toml": toml}


def _ask(state: State, session: Session, asked: dict[str, Any]) -> dict[str, Any]:
    request = dict(asked["request"])
    if request["ask"] == "save":
        target = state.room.path(request["target"], write=True)
        _require_free(target, request["what"])
        request["target"] = str(target)
    session.ask(asked["run"], request)
    return {"asked": True}


def _require_free(target: Path, what: str) -> None:
    """Refuse to write over what no report made."""
    if not target.parent.is_dir():
        raise ValueError(f"{target.parent} is no folder; make it first")
    made = what == "report" and (target / "analysis.json").is_file()
    if target.exists() and not made and not (target.is_dir() and not any(target.iterdir())):
        raise ValueError(f"{target} is there already; give another name")


_ANSWERS: Final[dict[str, Answer]] = {
    "start": lambda state, page, asked: {"first": state.first, **state.room.listing(".")},
    "list": lambda state, page, asked: state.room.listing(asked["folder"]),
    "campaign": lambda state, page, asked: campaign_table(state.room.path(asked["folder"])),
    "open": _open,
    "window": _window,
    "spectra": lambda state, page, asked: looks.spectra_of(page.looks[asked["look"]]),
    "check": lambda state, page, asked: {"findings": looks.findings(page.looks[asked["look"]])},
    "repeat": _repeat,
    "analyze": _analyze,
    "cancel": lambda state, page, asked: {"cancelled": page.cancel(int(asked["run"]))},
    "ask": _ask,
    "bye": lambda state, page, asked: {"closed": state.sessions.close(asked["left"])},
}


class _Nothing(_Handler):
    """Any other address."""

    def prepare(self) -> None:
        self.path_args = [self.request.path.split("/")[1]]
        super().prepare()
        raise web.HTTPError(404, reason="No such page")


def bokeh_scripts() -> Path:
    """The folder of the scripts that the plotting library brings.

    MissingExtra if it is not installed.
    """
    spec = find_spec("bokeh")
    if spec is None or spec.origin is None:
        raise sagnac.MissingExtra("the page", "bokeh", "app")
    return Path(spec.origin).parent / "server" / "static" / "js"


def application(state: State) -> web.Application:
    """The addresses and what answers them."""
    given = {"state": state}
    places = {"events": _Events, "drop": _Drop, "call/([a-z]+)": _Call, "([a-z.-]*)": _File}
    handlers = [(rf"/([^/]+)/{place}", handler, given) for place, handler in places.items()]
    others: dict[str, Any] = {"default_handler_class": _Nothing, "default_handler_args": given}
    return web.Application(handlers, **others, log_function=lambda handler: None)


@contextlib.contextmanager
def _room(file: Path | None) -> Iterator[tuple[Room, str]]:
    """The room of a file, of a folder or of the current folder, and the file's name in it."""
    place = Path.cwd() if file is None else file.resolve()
    first = "" if file is None or place.is_dir() else place.name
    root = place if place.is_dir() else place.parent
    if not place.exists():
        raise sagnac.RecordingError("no such file", path=str(file), remedy="check the path")
    with tempfile.TemporaryDirectory(prefix="sagnac-app-", ignore_cleanup_errors=True) as dropped:
        yield Room(root=root.resolve(), dropped=Path(dropped).resolve()), first


def serve(file: Path | None, *, port: int = 0, opened: Callable[[str], None]) -> None:
    """Serve the page until it is interrupted.

    Parameters
    ----------
    file
        To open, or the folder to work in; None for the current one.
    port
        To listen on; 0 for any that is free.
    opened
        Called with the address when the page can be loaded.

    Raises
    ------
    MissingExtra
        If what the page needs is not installed.
    RecordingError
        If the port is taken, or the file is not there.
    """
    bokeh_scripts()
    # What a page does wrong it is told itself; the terminal holds the address.
    logging.getLogger("tornado").setLevel(logging.CRITICAL)
    with _room(file) as (room, first):
        asyncio.run(_served(room, first, port, opened))


def _warm_up() -> None:
    """Look at a recording of nothing: what reads and checks is loaded before it is asked for."""
    rates = np.random.default_rng(1).standard_normal(999)
    made = sagnac.Recording.from_arrays(x=rates, kind="rate", unit="deg/h", sample_rate=1.0)
    failures = contextlib.suppress(sagnac.RecordingError, OSError)
    # A folder of its own: this may still write when the server has ended and its folder is gone.
    with failures, tempfile.TemporaryDirectory(prefix="sagnac-app-") as folder:
        looks.findings(looks.look(sagnac.write(made, Path(folder) / "warm-up.parquet"), {}))


async def _served(room: Room, first: str, port: int, opened: Callable[[str], None]) -> None:
    """Serve until the task is cancelled or an interrupt is raised in it."""
    try:
        listening = socket.create_server((HOST, port))
    except OSError as error:
        said = f"port {port} cannot be listened on ({error.strerror})"
        raise sagnac.RecordingError(said, remedy="give another, or none ({port})") from None
    port = listening.getsockname()[1]
    state = State(token=secrets.token_urlsafe(32), port=port, room=room, first=first)
    server = HTTPServer(application(state), max_body_size=2**20)
    listening.setblocking(False)
    server.add_socket(listening)
    try:
        opened(f"http://{HOST}:{port}/{state.token}/")
        state.threads.submit(_warm_up)
        while True:
            await asyncio.sleep(30.0)
            await asyncio.to_thread(state.sessions.forget_left)
    finally:
        server.stop()
        state.sessions.end()
        state.threads.shutdown(wait=False, cancel_futures=True)
        await server.close_all_connections()
