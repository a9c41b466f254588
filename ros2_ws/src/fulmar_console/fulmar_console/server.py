"""The server of the page: HTTP for its files, and one websocket a page."""

from __future__ import annotations

import asyncio
import contextlib
import http
import itertools
import json
import logging
import secrets
import socket
import time
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from fulmar_console.access import HEADERS, Access
from fulmar_console.pages import Pages, compressed
from fulmar_console.protocol import CommandRefusedError, pack_frame, pack_image, read_command
from fulmar_console.source import Source

FRAME_S, SLOW_S = 0.04, 0.2  # between two frames, and two looks at all else [s]
SAID_ANEW_S = 2.0  # between two messages of the health of every robot [s]
FLEETING = ("age_s", "sim_time_s")  # keys of health that change without anything that happens
FULL_BYTES = 65_536  # waiting for a page, beyond which it misses frames
MOST_PAGES = 32
LARGEST = 65_536  # bytes of a message from a page
EVENTS_KEPT = 100
SOCKET = "/socket"
PING_S = 5.0  # between two pings, and the longest wait for the answer [s]
ENDS_S = 1.0  # for pages to take the last message [s]
# Of health, what a page without the token may know: whether its e-stop worked.
STOP_KEYS = ("estop", "stopped", "level", "age_s")

log = logging.getLogger("fulmar_console")


@dataclass(eq=False)
class Client:
    """One page: `trusted` had the token, or none is needed; `camera` is the robot whose images it shows."""

    connection: ServerConnection
    name: str
    trusted: bool
    last_id: int = 0
    camera: str = ""

    @property
    def keeps_up(self) -> bool:
        """Whether it takes what it is sent."""
        return bool(self.connection.transport.get_write_buffer_size() <= FULL_BYTES)


class ConsoleServer:
    """Serves one source to pages."""

    def __init__(self, source: Source, access: Access, pages: Pages | None = None) -> None:
        """Serve a source, by these rules, with the shipped page unless another is given."""
        self._source, self._access, self._pages = source, access, pages or Pages()
        self.session = secrets.token_urlsafe(8)
        self._clients: set[Client] = set()
        self._numbers = itertools.count(1)
        self._frames = itertools.count()
        self._events: deque[dict[str, Any]] = deque(maxlen=EVENTS_KEPT)
        self._said: dict[str, str] = {}  # health that pages have, by robot
        self._said_s = 0.0
        self._robots = -1  # version that pages have
        self._loop: asyncio.AbstractEventLoop

    async def run(
        self, listening: socket.socket, stop: asyncio.Event, ready: asyncio.Event | None = None
    ) -> None:
        """Serve on a socket until `stop` is set; `ready` is set once connections are taken."""
        self._loop = asyncio.get_running_loop()
        async with self._listening(listening):
            if ready is not None:
                ready.set()
            tasks = [
                asyncio.create_task(work) for work in (self._send_frames(), self._send_news(), stop.wait())
            ]
            done, others = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in others:
                task.cancel()
            self._tell(self._all(), {"type": "bye", "words": "the console has ended"})
            await asyncio.sleep(min(ENDS_S, 0.1 * len(self._clients)))
            for task in done:
                task.result()

    def _listening(self, listening: socket.socket) -> contextlib.AbstractAsyncContextManager[object]:
        return serve(
            self._attend, sock=listening, process_request=self._answer, compression=None, max_size=LARGEST,
            max_queue=16, ping_interval=PING_S, ping_timeout=PING_S, close_timeout=ENDS_S, server_header=None,
            logger=log,
        )  # fmt: skip

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for a file; None lets a websocket open."""
        path, headers = urlsplit(request.path).path, request.headers
        refused = self._access.why_refused(
            headers.get_all("Host"), headers.get_all("Origin"), upgrade=path == SOCKET
        )
        if refused:
            return _response(http.HTTPStatus.FORBIDDEN, f"{refused}\n".encode())
        if path == SOCKET:
            if len(self._clients) >= MOST_PAGES:
                return _response(http.HTTPStatus.SERVICE_UNAVAILABLE, b"too many pages are open: close one\n")
            return None
        cookie = self._access.cookie_for(request.path)
        if cookie:
            return _response(http.HTTPStatus.SEE_OTHER, b"", {"Location": "/", "Set-Cookie": cookie})
        found = self._pages.file(path)
        if found is None and self._access.knows(headers.get_all("Cookie")):
            content = self._source.file(path)
            found = None if content is None else (content, "application/octet-stream")
        if found is None:
            return _response(
                http.HTTPStatus.NOT_FOUND, b"there is nothing at this address; the page is at /\n"
            )
        return _file(*found, zipped="gzip" in headers.get("Accept-Encoding", ""))

    async def _attend(self, connection: ServerConnection) -> None:
        request = connection.request
        assert request is not None
        trusted = self._access.knows(request.headers.get_all("Cookie"))
        client = Client(connection, f"page {next(self._numbers)}", trusted)
        self._clients.add(client)
        try:
            self._greet(client)
            async for message in connection:
                self._take(client, message)
        except ConnectionClosed:
            pass
        finally:
            self._clients.discard(client)
            self._source.forget(client.name)

    def _greet(self, client: Client) -> None:
        hello = {
            "type": "hello", "version": self._pages.version, "session": self.session, "mode": self._source.mode,
            "client": client.name, "controls": client.trusted, **self._source.hello(),
        }  # fmt: skip
        self._tell([client], hello)
        self._tell([client], {"type": "robots", "robots": self._records(client)})
        self._tell([client], {"type": "health", "robots": _seen_by(client, self._source.health())})
        for event in self._events if client.trusted else ():
            self._tell([client], event)

    def _records(self, client: Client) -> list[dict[str, Any]]:
        robots = self._source.robots()
        return robots if client.trusted else [{**robot, "info": None} for robot in robots]

    def _take(self, client: Client, message: str | bytes) -> None:
        """Do what a page asks for, or say why not."""
        names = [robot["name"] for robot in self._source.robots()]
        number = _number_of(message)
        answer = partial(self._answer_later, client, number)
        try:
            command = read_command(
                message, session=self.session, last_id=client.last_id, now_s=time.time(), robots=names
            )
            if not client.trusted and command["do"] != "estop":
                raise CommandRefusedError(
                    "only stopping is allowed without the token: open the address that has it"
                )
        except CommandRefusedError as refused:
            answer(False, str(refused))
            return
        if command["do"] != "estop":
            client.last_id = command["id"]
        if command["do"] == "look":
            client.camera = str(command["robot"]) if command["camera"] else ""
        self._source.do(command, answer, client.name)

    def _answer_later(self, client: Client, number: object, accepted: bool, words: str) -> None:
        message = {"type": "answer", "id": number, "accepted": accepted, "words": words}
        with contextlib.suppress(RuntimeError):  # the server has ended
            self._loop.call_soon_threadsafe(self._tell, [client], message)

    async def _send_frames(self) -> None:
        """Frames at an even pace; one that is late is left out."""
        due = self._loop.time()
        while True:
            due = max(due + FRAME_S, self._loop.time())
            await asyncio.sleep(due - self._loop.time())
            pages = [client for client in self._clients if client.trusted and client.keeps_up]
            if not pages:
                continue
            samples, age_s = self._source.frame()
            self._broadcast(pages, pack_frame(next(self._frames), time.time(), age_s, samples))
            self._send_images(pages)

    def _send_images(self, pages: list[Client]) -> None:
        images = self._source.images()
        names = {robot["index"]: robot["name"] for robot in self._source.robots()} if images else {}
        for image in images:
            looking = [client for client in pages if client.camera == names.get(image.index)]
            self._broadcast(looking, pack_image(image))

    async def _send_news(self) -> None:
        """Robots, health and events, on change; health at least once a second."""
        while True:
            await asyncio.sleep(SLOW_S)
            if self._source.version() != self._robots:
                self._robots = self._source.version()
                for client in self._clients:
                    self._tell([client], {"type": "robots", "robots": self._records(client)})
            self._send_health()
            for event in self._source.events():
                event = {"type": "event", **event}
                self._events.append(event)
                self._tell([client for client in self._clients if client.trusted], event)

    def _send_health(self) -> None:
        """Health of the robots of which something has changed, and of all now and then."""
        health, now = self._source.health(), time.monotonic()
        texts = {name: json.dumps(_lasting(each)) for name, each in health.items()}
        whole = now - self._said_s > SAID_ANEW_S
        changed = {name: health[name] for name in health if whole or texts[name] != self._said.get(name)}
        if not changed:
            return
        self._said, self._said_s = texts, now if whole else self._said_s
        for trusted in (True, False):
            pages = [client for client in self._clients if client.trusted is trusted]
            if pages:
                self._tell(pages, {"type": "health", "robots": _seen_by(pages[0], changed)})

    def _all(self) -> list[Client]:
        return list(self._clients)

    def _tell(self, clients: Iterable[Client], message: dict[str, Any]) -> None:
        self._broadcast(
            [client for client in clients if client.keeps_up], json.dumps(message, allow_nan=False)
        )

    @staticmethod
    def _broadcast(clients: Iterable[Client], message: str | bytes) -> None:
        broadcast([client.connection for client in clients], message)


def _seen_by(client: Client, health: Any) -> dict[str, Any]:
    """Health as a page may know it."""
    if client.trusted:
        return dict(health)
    return {name: {key: each[key] for key in STOP_KEYS if key in each} for name, each in health.items()}


def _lasting(health: Mapping[str, Any]) -> dict[str, Any]:
    """Health without what changes all the time."""
    return {key: value for key, value in health.items() if key not in FLEETING}


def _number_of(message: str | bytes) -> object:
    """The number of a command that may be wrong otherwise."""
    try:
        command = json.loads(message)
    except (ValueError, RecursionError):
        return None
    return command.get("id") if isinstance(command, dict) else None


def _file(content: bytes, kind: str, *, zipped: bool) -> Response:
    more = {"Content-Type": kind, "Cache-Control": "no-cache"}
    if zipped and len(content) > 1000 and not kind.startswith("application"):
        content, more = compressed(content), {**more, "Content-Encoding": "gzip", "Vary": "Accept-Encoding"}
    return _response(http.HTTPStatus.OK, content, more)


def _response(status: http.HTTPStatus, body: bytes, more: dict[str, str] | None = None) -> Response:
    fields = {"Content-Type": "text/plain; charset=utf-8", **HEADERS, **(more or {})}
    headers = Headers({**fields, "Content-Length": str(len(body)), "Connection": "close"})
    return Response(status.value, status.phrase, headers, body)
