"""A server in a thread of its own, on a folder of its own, and a browser that is a few lines."""

import asyncio
import http.client
import json
import socket
import threading
import time
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from tornado.httpserver import HTTPServer

import sagnac
from sagnac.app.server import HOST, State, application
from sagnac.app.sessions import Room, Sessions

PAGE = "abcdef0123456789"


@dataclass
class Server:
    """A server and what a page asks of it."""

    state: State
    folder: Path

    def request(self, method, path, body=None, **headers):
        given = {"Origin": f"http://{HOST}:{self.state.port}", "X-Page": PAGE, **headers}
        given = {name.replace("_", "-"): value for name, value in given.items() if value}
        made = http.client.HTTPConnection(HOST, self.state.port, timeout=30)
        with closing(made) as connection:
            connection.request(method, path, body, given)
            with connection.getresponse() as answer:
                return answer.status, answer.read().decode(), answer.headers

    def call(self, name, page=PAGE, **asked):
        status, text, _ = self.request(
            "POST", f"/{self.state.token}/call/{name}", json.dumps(asked), X_Page=page
        )
        assert status == 200, text
        return json.loads(text)

    def opened(self, path, **texts):
        return self.call("open", path=str(path), texts=texts)

    def events(self, page=PAGE, patience=60.0):
        """Events of a page from now on, as they come, for a while."""
        begun = time.monotonic()
        connection = http.client.HTTPConnection(HOST, self.state.port, timeout=60)
        connection.request("GET", f"/{self.state.token}/events?page={page}")
        answer = connection.getresponse()

        def told():
            with closing(connection), answer:
                for line in answer:
                    assert time.monotonic() - begun < patience
                    if line.startswith(b"data: "):
                        yield json.loads(line[6:])

        return told()


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    folder, dropped = (tmp_path_factory.mktemp(name).resolve() for name in ("room", "dropped"))
    ready, loop = threading.Event(), asyncio.new_event_loop()
    listening = socket.create_server((HOST, 0))
    listening.setblocking(False)
    port = listening.getsockname()[1]
    room = Room(root=folder, dropped=dropped)
    state = State(token="t" * 43, port=port, room=room, sessions=Sessions(loop=loop))
    made = []

    async def start():
        made.append(HTTPServer(application(state), max_body_size=2**20))
        made[0].add_socket(listening)
        ready.set()

    def serve():
        asyncio.set_event_loop(loop)
        loop.create_task(start())
        loop.run_forever()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    assert ready.wait(10)
    yield Server(state=state, folder=folder)
    state.sessions.end()

    async def stop():
        made[0].stop()
        await made[0].close_all_connections()
        for task in asyncio.all_tasks() - {asyncio.current_task()}:
            task.cancel()
        await asyncio.sleep(0.05)
        loop.stop()

    asyncio.run_coroutine_threadsafe(stop(), loop)
    thread.join(10)
    state.threads.shutdown()
    loop.close()


@pytest.fixture(scope="module")
def still(server):
    """Ten minutes at 100 Hz of three gyros that sense the Earth, 0.003 deg/sqrt(h)."""
    random = np.random.default_rng(7)
    walk = 0.003 * 60.0 * np.sqrt(100.0)
    earth = {"x": 9.0, "y": 2.0, "z": np.sqrt(15.041**2 - 85.0)}
    arrays = {name: mean + walk * random.standard_normal(60_000) for name, mean in earth.items()}
    arrays["x"] += 3.0 * np.cos(2.0 * np.pi * 7.0 * np.arange(60_000) / 100.0)
    recording = sagnac.Recording.from_arrays(**arrays, kind="rate", unit="deg/h", sample_rate=100.0)
    return sagnac.write(recording, server.folder / "still.parquet")
