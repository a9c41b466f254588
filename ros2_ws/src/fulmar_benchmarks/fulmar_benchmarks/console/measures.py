"""The measurements of the console, each in processes of its own."""

from __future__ import annotations

import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from sensor_msgs.msg import JointState

from fulmar_benchmarks.console.systems import System, browser, opened, system, wait_for
from fulmar_bringup.domains import own_domain
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.topics import ACTUATORS_STATE
from fulmar_core.wires.robot_name import namespace_of
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import ros_node

ROBOT = "floating_platform"
UP = ("up", "mujoco_lqr", "--console", "--console-port", "0", "--json", "--no-markers")
SETTLES_S = 6.0  # until the console has found every robot [s]
FAR = 2.5  # where a goal lies, so that valves open at once [m]
STOPS_S, CONFIRMS_S = 1.0, 0.7  # in which a stop has to arrive, and the page has to say that it did not [s]


def recorded_run(bag: Path, robot: str, controller: str, seconds: float) -> Path:
    """A bag of a run in lock step; made where there is none.

    Raises:
        RunFailed: It was not recorded.
    """
    if bag.exists():
        return bag
    command = [
        "run",
        robot,
        "--controller",
        controller,
        "--lockstep",
        "--seed",
        "3",
        "--duration",
        f"{seconds:g}",
    ]
    with own_domain() as environment:
        done = subprocess.run(
            [sys.executable, "-m", "fulmar_cli.main", *command, "--record", str(bag)], check=False, cwd=bag.parent,
            env={**os.environ, **environment}, capture_output=True, text=True,
        )  # fmt: skip
    if not bag.exists():
        raise RunFailed(f"{bag.name} was not recorded: {' / '.join(done.stderr.strip().splitlines()[-2:])}")
    return bag


class Listener:
    """Clients that receive everything, in a process of their own, and count it."""

    PROGRAM = (
        "import asyncio, json, sys, time, websockets\n"
        "async def listen(url, seconds):\n"
        "    origin, count, frames, robots, until = url.rstrip('/'), 0, 0, 0, time.monotonic() + seconds\n"
        "    async with websockets.connect(origin.replace('http', 'ws', 1) + '/socket', origin=origin) as socket:\n"
        "        while time.monotonic() < until:\n"
        "            message = await socket.recv()\n"
        "            count, frames = count + len(message), frames + isinstance(message, bytes)\n"
        "            if isinstance(message, bytes): robots = int.from_bytes(message[2:4], 'little')\n"
        "    return count, frames, robots\n"
        "async def main(url, seconds, clients):\n"
        "    got = await asyncio.gather(*[listen(url, seconds) for _ in range(clients)])\n"
        "    print(json.dumps(dict(zip(('bytes', 'frames', 'robots'), zip(*got)))))\n"
        "asyncio.run(main(sys.argv[1], float(sys.argv[2]), int(sys.argv[3])))\n"
    )

    def __init__(self, url: str, seconds: float, clients: int = 1) -> None:
        """Begin to listen to a console for a time [s]."""
        command = [sys.executable, "-c", self.PROGRAM, url, f"{seconds:g}", str(clients)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE)

    def counted(self) -> dict[str, list[int]]:
        """Bytes and frames of each client."""
        out, _ = self._process.communicate()
        found: dict[str, list[int]] = json.loads(out)
        return found


def server_cost(folder: Path, robots: int, clients: int, seconds: float) -> dict[str, Any]:
    """Processor time and bytes of a console that receives robots from a bag over ROS and serves pages."""
    bag = recorded_run(folder / "run", ROBOT, "lqr", 10.0)
    fleet = [sys.executable, "-m", "fulmar_benchmarks.console.fleet", str(bag), "--robots", str(robots)]
    with own_domain() as environment:
        length = f"{seconds + SETTLES_S + 10.0:g}"
        load = subprocess.Popen([*fleet, "--seconds", length], env={**os.environ, **environment}, cwd=folder)
        try:
            with system(("console", "--port", "0", "--json"), folder, environment) as console:
                url = console.event("url")["url"]
                time.sleep(SETTLES_S)
                server = psutil.Process(console.process.pid)
                before, listener = server.cpu_times(), Listener(url, seconds, clients)
                counted = listener.counted()
                after = server.cpu_times()
        finally:
            load.kill()
            load.wait()
    if min(counted["robots"]) < robots:
        raise RunFailed(f"the console shows {min(counted['robots'])} of {robots} robots.")
    used = (after.user + after.system) - (before.user + before.system)
    return {
        "robots": robots,
        "clients": clients,
        "cores": used / seconds,
        "bytes_per_s": max(counted["bytes"]) / seconds,
        "frames_per_s": min(counted["frames"]) / seconds,
    }


def first_image(folder: Path, rounds: int) -> dict[str, Any]:
    """Time from `fulmar up --console` to the first image, and to the first with the robot in it [s]."""
    drawn, robot = [], []
    with browser() as started:
        for number in range(rounds):
            place = folder / f"first_{number}"
            place.mkdir(exist_ok=True)
            with own_domain() as environment, system(UP, place, environment) as up:
                url = up.event("url")["url"]
                page = started.new_page(viewport={"width": 640, "height": 400})
                page.goto(f"{url}?plain")
                wait_for(page, "window.fulmar && fulmar.scene && fulmar.scene.draws > 0")
                drawn.append(time.monotonic() - up.began_s)
                wait_for(page, "fulmar.scene.robots.size > 0 && fulmar.scene.draws > 1")
                robot.append(time.monotonic() - up.began_s)
                page.close()
    return {"first_s": drawn, "with_robot_s": robot, "median_s": float(np.median(drawn))}


def latency_pairs(folder: Path, pairs: int, seconds: float) -> dict[str, Any]:
    """p99 of the latency of the control loop with a client that receives all, and without, in turn [ms]."""
    found: dict[str, list[float]] = {"off": [], "on": []}
    for number in range(pairs):
        for what in ("off", "on") if number % 2 == 0 else ("on", "off"):
            place = folder / f"latency_{number}_{what}"
            place.mkdir(exist_ok=True)
            found[what].append(_latency(place, seconds, watched=what == "on"))
    return {"p99_ms": found, "ratio": float(np.median(found["on"]) / np.median(found["off"]))}


def _latency(folder: Path, seconds: float, *, watched: bool) -> float:
    arguments = [
        "run", ROBOT, "--controller", "lqr", "--control-hz", "50", "--duration", f"{seconds:g}", "--seed", "3",
        "--record", str(folder / f"bag_{time.time_ns()}"), "--json",
    ]  # fmt: skip
    with own_domain() as environment:
        run = subprocess.Popen(
            [sys.executable, "-m", "fulmar_cli.main", *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            cwd=folder, env={**os.environ, **environment},
        )  # fmt: skip
        if not watched:
            out, _ = run.communicate()
        else:
            with system(("console", "--port", "0", "--json"), folder, environment) as console:
                listener = Listener(console.event("url")["url"], seconds)
                out, _ = run.communicate()
                listener.counted()
    return float(json.loads(out)["latency_ms"]["p99"])


class Valves:
    """What the actuators of a robot do, with the time of each message by the wall clock."""

    def __init__(self, node: Any) -> None:
        """Listen with a node that spins."""
        self.open_s = 0.0  # when a message said last that a valve is open
        self.closed_s = 0.0  # when the first one after that said that all are closed; infinite: none yet
        self.seen: deque[tuple[float, bool]] = deque(maxlen=1000)
        wire = ACTUATORS_STATE
        topic = f"{namespace_of(ROBOT)}/{wire.name}"
        node.create_subscription(JointState, topic, self._take, subscriber_qos(wire, reliable=True, depth=50))
        self._changed = threading.Condition()

    def _take(self, message: JointState) -> None:
        with self._changed:
            now_s, is_open = time.time(), any(message.effort)
            self.seen.append((now_s, is_open))
            if is_open:
                self.open_s, self.closed_s = now_s, math.inf
            elif math.isinf(self.closed_s):
                self.closed_s = now_s
            self._changed.notify_all()

    def open_at(self, moment_s: float) -> bool:
        """Whether the last message before a moment said that a valve is open."""
        with self._changed:
            return next((is_open for when_s, is_open in reversed(self.seen) if when_s < moment_s), False)

    def wait(self, condition: Callable[[], bool], within_s: float) -> bool:
        """Whether something held within a time [s]."""
        with self._changed:
            return self._changed.wait_for(condition, within_s)


def stops(folder: Path, rounds: int) -> dict[str, Any]:
    """Clicks on the e-stop while a valve is open: time to the message from which on actuators stay at zero [ms]."""
    took: list[float] = []
    with own_domain() as environment, browser() as started, system(UP, folder, environment) as up:
        os.environ.update(environment)
        up.event("event", "started")
        page = opened(started, up.event("url")["url"])
        errors: list[Exception] = []
        with ros_node("clicks", errors.append) as node:
            valves = Valves(node)
            side = 1.0
            while len(took) < rounds:
                side = -side
                _goal(page, side * FAR)
                opened_s = time.time()
                if not valves.wait(lambda since=opened_s: valves.open_s > since, STOPS_S):  # type: ignore[misc]
                    continue
                clicked_s = _click(page)
                valves.wait(lambda: False, STOPS_S)
                if valves.open_at(clicked_s):
                    took.append(1e3 * (valves.closed_s - clicked_s))
                _release(page)
    return {"clicks": len(took), "ms": took, "late": sum(each >= 300.0 for each in took)}


LISTEN = (
    "window.clicked = new Promise((done) => document.getElementById('estop').addEventListener("
    "'click', (event) => done((performance.timeOrigin + event.timeStamp) / 1000), {once: true})); true"
)


def _click(page: Any) -> float:
    """Click on the e-stop by the mouse; returns when the browser saw that, by the wall clock [s]."""
    page.evaluate(LISTEN)
    page.click("#estop", no_wait_after=True)
    return float(page.evaluate("window.clicked"))


def _goal(page: Any, x: float) -> None:
    page.evaluate(
        "(x) => fulmar.feed.send({do: 'goal', robot: fulmar.selected.name, targets: [[x, 0, 0, 0, 0, 0, 1]]})",
        x,
    )


def _release(page: Any) -> None:
    """Reset, and again until it is done: commands have to be zero for a moment."""
    for _ in range(10):
        if page.evaluate("fulmar.feed.send({do: 'reset', robot: fulmar.selected.name})")["accepted"]:
            wait_for(page, "!fulmar.health.get(fulmar.selected.name).estop")
            return
        time.sleep(0.3)
    raise RunFailed("the e-stop was not released in ten tries.")


def unconfirmed(folder: Path, rounds: int) -> dict[str, Any]:
    """Clicks on the e-stop while the console's process stands still: how often the page says NOT CONFIRMED in time."""
    said = 0
    with own_domain() as environment, browser() as started, system(UP, folder, environment) as up:
        up.event("event", "started")
        url = up.event("url")["url"]
        console = _console_of(up)
        for _ in range(rounds):
            page = opened(started, url)
            console.send_signal(signal.SIGSTOP)
            try:
                _click(page)
                with contextlib.suppress(RunFailed):
                    wait_for(
                        page, "document.getElementById('stopstate').textContent.startsWith('NOT CONFIRMED')"
                    )
                    said += 1
            finally:
                console.send_signal(signal.SIGCONT)
            wait_for(page, "fulmar.health.get(fulmar.selected.name).estop")  # it comes, late
            _release(page)
            page.close()
    return {"clicks": rounds, "not_confirmed": said}


def _console_of(up: System) -> psutil.Process:
    for child in psutil.Process(up.process.pid).children(recursive=True):
        if "fulmar_console.live" in child.cmdline():
            return child
    raise RunFailed("the console's process is not found.")


def bag_opening(folder: Path, seconds: float) -> dict[str, Any]:
    """Time until a page plays bags of three robots, and how many requests scrubbing makes."""
    place = folder / "three"
    place.mkdir(exist_ok=True)
    for robot, controller in ((ROBOT, "lqr"), ("kingfisher", "classical"), ("turtlebot2", "classical")):
        recorded_run(place / robot, robot, controller, seconds)
    with (
        browser() as started,
        system(("console", str(place), "--port", "0", "--json"), folder, {}) as console,
    ):
        url = console.event("url")["url"]
        page = started.new_page(viewport={"width": 640, "height": 400})
        requests: list[str] = []
        page.on("request", lambda request: requests.append(request.url))
        page.goto(f"{url}?plain")
        placed = (
            "fulmar.scene.robots.size === 3 && [...fulmar.scene.robots.values()].every((each) => each.placed)"
        )
        slides = "document.querySelector('#timeline input[type=range]')"
        wait_for(page, f"window.fulmar && fulmar.scene && fulmar.frames > 0 && {placed} && {slides}")
        page.evaluate("new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
        opened_s = time.monotonic() - console.began_s
        before = len(requests)
        robots = page.evaluate("fulmar.robots.size")
        slider = page.locator("#timeline input[type=range]").first
        frames = page.evaluate("fulmar.frames")
        for share in (0.1, 0.9, 0.5, 0.3):
            slider.evaluate(
                "(it, share) => { it.value = Number(it.min) + share * (it.max - it.min);"
                "it.dispatchEvent(new Event('input', {bubbles: true})); }",
                share,
            )
            time.sleep(0.2)
        return {
            "robots": robots,
            "open_s": opened_s,
            "scrubbed_frames": page.evaluate("fulmar.frames") - frames,
            "requests_while_scrubbing": len(requests) - before,
        }
