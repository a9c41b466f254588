"""A server of the page over real sockets, with a source that only notes what it is asked."""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
import time
from http.client import HTTPConnection

from websockets.sync.client import connect

from fulmar_console.access import Access
from fulmar_console.process import bound
from fulmar_console.server import SOCKET, ConsoleServer
from fulmar_console.source import RobotSample

INFO = {"name": "boat", "controllers": [], "actuators": []}


class Noting:
    """A source of one robot that stands still."""

    mode = "live"

    def __init__(self):
        self.done, self.gone = [], []

    def start(self):
        """Nothing to begin."""

    def hello(self):
        return {}

    def version(self):
        return 1

    def robots(self):
        return [{"index": 0, "name": "boat", "color": "#42a5f5", "info": INFO}]

    def frame(self):
        return [RobotSample(0, 0.1, (1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0), (0.5, -1.0))], 0.0

    def health(self):
        return {"boat": {"estop": False, "level": "ok", "words": "secret"}}

    def events(self):
        return []

    def images(self):
        return []

    def do(self, command, answer, client):
        self.done.append(command)
        answer(True, "done")

    def forget(self, client):
        self.gone.append(client)

    def file(self, path):
        return b"bag" if path == "/bags/0.bin" else None

    def close(self):
        """Nothing to end."""


class Served:
    """A running server."""

    def __init__(self, port, source, server, token):
        self.port, self.source, self.server, self.token = port, source, server, token
        self.origin = f"http://127.0.0.1:{port}"

    def get(self, path="/", **headers):
        """Status, headers and body of a request; `Host` may be another."""
        connection = HTTPConnection("127.0.0.1", self.port, timeout=5.0)
        connection.putrequest("GET", path, skip_host="Host" in headers, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders()
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer.status, dict(answer.getheaders()), body

    def drop_pages(self):
        """Cut the connection of every page."""
        for client in list(self.server._clients):
            self.server._loop.call_soon_threadsafe(client.connection.transport.abort)

    @contextlib.contextmanager
    def page(self, **more):
        """A page that has its first messages."""
        more.setdefault("origin", self.origin)
        with connect(f"ws://127.0.0.1:{self.port}{SOCKET}", **more) as socket:
            yield Page(socket)


class Page:
    """A websocket as a page has it."""

    def __init__(self, socket):
        self.socket = socket
        self.hello = self.until("hello")

    def until(self, kind):
        """The next message of a kind."""
        while True:
            message = self.socket.recv(timeout=5.0)
            if isinstance(message, bytes):
                if kind == "frame":
                    return message
            elif (content := json.loads(message))["type"] == kind:
                return content

    def ask(self, **command):
        """The answer to a command that is well formed unless the arguments say otherwise."""
        full = {"id": 1, "session": self.hello["session"], "at": time.time(), "robot": "boat", **command}
        self.socket.send(json.dumps(full))
        return self.until("answer")


@contextlib.contextmanager
def served(token=""):
    """A server while the context lasts."""
    listening, source = bound("127.0.0.1", 0), Noting()
    port = listening.getsockname()[1]
    loop, stop, ready = asyncio.new_event_loop(), asyncio.Event(), asyncio.Event()
    server = ConsoleServer(source, Access("127.0.0.1", port, token))
    thread = threading.Thread(target=loop.run_until_complete, args=(server.run(listening, stop, ready),))
    thread.start()
    try:
        yield Served(port, source, server, token)
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join(10.0)
        loop.close()
