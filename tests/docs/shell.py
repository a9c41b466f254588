"""One folder, one ROS domain and one environment for the command lines of a page, with servers beside them."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

# Commands that run until Ctrl-C, and what they print once they are ready.
SERVERS = [
    (re.compile(r"\bfulmar up (?!.*--dry-run)"), "started:"),
    (re.compile(r"\bfulmar console\b"), "console: http"),
    (re.compile(r"\bfulmar view\b"), "foxglove: ws"),
    (re.compile(r"\bfulmar teleop\b"), "dead-man switch"),
    (re.compile(r"^python steer"), ""),
    (re.compile(r"^python (?!steer)"), "ready"),
]
READY_S, ENDS_S = 40.0, 30.0
INTERRUPTED = (0, 130, -signal.SIGINT)


@dataclass(frozen=True)
class Outcome:
    """What a command line did."""

    text: str
    code: int
    seconds: float
    output: str


@dataclass
class Server:
    """A command that runs until Ctrl-C; it has a terminal, since `teleop` reads keys."""

    text: str
    process: subprocess.Popen[bytes]
    master: int
    output: list[str] = field(default_factory=list)

    def read(self) -> None:
        """Collect what it prints, until it ends."""
        while True:
            try:
                part = os.read(self.master, 65536)
            except OSError:
                return
            self.output.append(part.decode(errors="replace"))

    def shown(self) -> str:
        """What it has printed."""
        return "".join(self.output)


class PageShell:
    """Runs the lines of a page one after the other, as a reader who copies them."""

    def __init__(self, folder: Path, domain: int) -> None:
        """Work in a folder and a ROS domain."""
        self.folder = folder
        home = folder.parent / f"{folder.name}_home"
        home.mkdir(parents=True, exist_ok=True)
        self.env = os.environ | {
            "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_HOME": str(home),
        }
        self.servers: list[Server] = []

    def run(self, text: str, timeout_s: float) -> Outcome:
        """Run a line to its end."""
        begin = time.monotonic()
        process = subprocess.Popen(
            ["bash", "-c", text],
            cwd=self.folder,
            env=self.env,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            output, _ = process.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output, _ = process.communicate()
            output += f"\nIt was ended after {timeout_s:g} s.".encode()
        return Outcome(text, process.returncode, time.monotonic() - begin, output.decode(errors="replace"))

    def export(self, text: str) -> None:
        """Keep a variable for the lines after it: `export NAME=VALUE`."""
        name, _, value = text.removeprefix("export ").partition("=")
        self.env[name] = value.replace("$PWD", str(self.folder))

    def start(self, text: str) -> Outcome:
        """Start a server, and wait until it is ready."""
        begin = time.monotonic()
        ready = next(words for pattern, words in SERVERS if pattern.search(text))
        master, slave = pty.openpty()
        process = subprocess.Popen(
            ["bash", "-c", f"exec {text}"],
            cwd=self.folder,
            env=self.env,
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
        )
        os.close(slave)
        server = Server(text, process, master)
        threading.Thread(target=server.read, daemon=True).start()
        while ready not in server.shown() and process.poll() is None and time.monotonic() < begin + READY_S:
            time.sleep(0.05)
        seconds = time.monotonic() - begin
        if ready not in server.shown():
            code = process.poll()
            self._end(server)
            return Outcome(text, 124 if code is None else code or 1, seconds, server.shown())
        self.servers.append(server)
        return Outcome(text, 0, seconds, server.shown())

    def stop_servers(self, *keep: str) -> list[Outcome]:
        """Interrupt the servers, newest first, and give how each ended: code 0 where it ended as Ctrl-C does."""
        ended = []
        for server in reversed([each for each in self.servers if each.text not in keep]):
            self.servers.remove(server)
            begin = time.monotonic()
            code = self._end(server)
            ended.append(Outcome(f"{server.text}  # Ctrl-C", code, time.monotonic() - begin, server.shown()))
        return ended

    def _end(self, server: Server) -> int:
        code = server.process.poll()
        if code is None:
            server.process.send_signal(signal.SIGINT)
            try:
                code = server.process.wait(ENDS_S)
            except subprocess.TimeoutExpired:
                os.killpg(server.process.pid, signal.SIGKILL)
                server.process.wait()
                code = 124
        elif code == 0:
            code = 1  # a server ended by itself
        return 0 if code in INTERRUPTED else code
