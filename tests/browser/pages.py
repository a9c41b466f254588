"""The console's page in a real browser, beside a real system."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

CHROMIUM = "/usr/bin/chromium"  # Debian's, by `make setup-browser`
ARGUMENTS = ["--no-sandbox", "--use-angle=gl-egl", "--ignore-gpu-blocklist"]
SHOTS = Path(__file__).parents[2] / "runs" / "browser"  # what a person looks at afterwards
LONGEST_S = 60.0


@contextlib.contextmanager
def started_browser():
    """A browser; fails where there is none."""
    from playwright.sync_api import sync_playwright

    assert Path(CHROMIUM).exists(), "Chromium is missing. Install it: make setup-browser"
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        try:
            yield browser
        finally:
            browser.close()


class Page:
    """A page, with what it complained about; it is asked from outside, since it allows no `eval`."""

    def __init__(self, browser, url, size=(640, 400)):
        self.page, self.problems = browser.new_page(viewport={"width": size[0], "height": size[1]}), []
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on("console", lambda m: self.problems.append(m.text) if m.type == "error" else None)
        self.page.goto(url)

    def ask(self, expression):
        return self.page.evaluate(expression)

    def until(self, expression, within_s=LONGEST_S):
        """Wait for an expression to hold; returns how long it took [s]."""
        began = time.monotonic()
        while not self.ask(f"Boolean({expression})"):
            passed = time.monotonic() - began
            assert passed < within_s, (
                expression,
                self.problems,
                self.ask("document.body.innerText.slice(0, 600)"),
            )
            time.sleep(0.02)
        return time.monotonic() - began

    def ready(self):
        """Wait until the robot runs and is drawn."""
        self.until("window.fulmar?.frames > 5 && fulmar.scene.draws > 2")
        self.until("fulmar.selected && fulmar.health.get(fulmar.selected.name)?.plant_mode === 'running'")
        self.until(
            "fulmar.health.get(fulmar.selected.name).controller?.mode === 'armed' && fulmar.handle.group.visible"
        )
        time.sleep(0.5)

    def health(self):
        return self.ask("fulmar.health.get(fulmar.selected.name)")

    def state(self):
        return self.page.inner_text("#stopstate")

    def drag(self, start, end):
        """Drag by the mouse in steps, as a hand does."""
        mouse = self.page.mouse
        mouse.move(start["x"], start["y"])
        mouse.down()
        for i in range(1, 11):
            mouse.move(*(start[a] + (end[a] - start[a]) * i / 10 for a in "xy"))
            time.sleep(0.03)
        mouse.up()

    def screen(self, point):
        return self.ask(f"(({{x, y}}) => ({{x, y}}))(fulmar.scene.screen({json.dumps(point)}))")

    def keep(self, name):
        """Keep what it shows, for a person."""
        SHOTS.mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=SHOTS / f"{name}.png")


class Up:
    """`fulmar up --console` in a domain of its own."""

    def __init__(self, folder, domain, *arguments):
        environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }
        command = [
            sys.executable,
            "-m",
            "fulmar_cli.main",
            "up",
            *arguments,
            "--console",
            "--console-port",
            "0",
            "--json",
        ]
        self.log = folder / "up.log"
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                command,
                stdout=subprocess.PIPE,
                stderr=log,
                cwd=folder,
                env=environment,
                start_new_session=True,
            )
        self.url = json.loads(self.process.stdout.readline())["url"]

    def console(self):
        """The process of the page."""
        import psutil

        children = psutil.Process(self.process.pid).children(recursive=True)
        return next(each for each in children if "fulmar_console.live" in each.cmdline())

    def plant(self):
        """The process of the plant."""
        import psutil

        children = psutil.Process(self.process.pid).children(recursive=True)
        return next(each for each in children if any("sim_node" in part for part in each.cmdline()))

    def end(self):
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(15.0)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


@contextlib.contextmanager
def up(folder, domain, *arguments):
    """A system while the context lasts."""
    system = Up(folder, domain, *arguments)
    try:
        yield system
    finally:
        system.end()
