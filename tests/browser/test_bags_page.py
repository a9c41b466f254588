"""Bags on the console's page in a real browser: open, play in both directions, scrub, marks, two of them."""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time

import pytest

from fulmar_console.access import Access
from fulmar_console.bags.bag_source import BagSource
from fulmar_console.process import bound
from fulmar_console.server import ConsoleServer
from tests.fulmar_cli.bag_commands import BAGS, LQR, POLICY

pytestmark = pytest.mark.slow

CHROMIUM = "/usr/bin/chromium"  # Debian's, by `make setup-browser`
ARGUMENTS = ["--no-sandbox", "--use-angle=gl-egl", "--ignore-gpu-blocklist"]
LONGEST_S = 60.0


@contextlib.contextmanager
def served(*bags):
    """The address of a page that plays bags."""
    listening = bound("127.0.0.1", 0)
    port = listening.getsockname()[1]
    source = BagSource(bags)
    loop, stop = asyncio.new_event_loop(), asyncio.Event()
    server = ConsoleServer(source, Access("127.0.0.1", port))
    thread = threading.Thread(target=loop.run_until_complete, args=(server.run(listening, stop),))
    thread.start()
    source.start()
    try:
        yield f"http://127.0.0.1:{port}/?plain"
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join(10.0)
        source.close()


class Page:
    """A page of a browser, with what it asked for and what it complained about."""

    def __init__(self, page, address):
        self.page, self.problems, self.requests = page, [], []
        page.on("pageerror", lambda error: self.problems.append(str(error)))
        page.on("console", lambda m: self.problems.append(m.text) if m.type == "error" else None)
        page.on("request", lambda request: self.requests.append(request.url))
        page.goto(address)
        self.until("Boolean(window.fulmar?.timeline?.bags)")

    def ask(self, expression):
        return self.page.evaluate(expression)

    def until(self, expression):
        end = time.monotonic() + LONGEST_S
        while not self.ask(expression):
            assert time.monotonic() < end, (expression, self.problems, self.page.inner_text("#timeline"))
            time.sleep(0.05)


@pytest.fixture
def opened():
    """Opens bags in a browser; fails where there is none."""
    from playwright.sync_api import sync_playwright

    with contextlib.ExitStack() as stack:
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        stack.callback(browser.close)

        def open_bags(*bags):
            address = stack.enter_context(served(*bags))
            return Page(browser.new_page(viewport={"width": 1280, "height": 800}), address)

        yield open_bags


def position(page, index=0):
    return page.ask(f"fulmar.scene.positionOf({index}).toArray()")


def test_a_bag_opens_and_scrubs_without_a_request(opened):
    page = opened(LQR)
    before, begin = len(page.requests), position(page)
    page.page.locator("#scrub").fill("10")
    page.until("Math.abs(fulmar.timeline.t_s - 10) < 0.1")
    assert position(page) != begin
    page.page.click("#stepon")
    page.page.keyboard.press("ArrowLeft")
    page.page.click("#play")
    page.until("fulmar.timeline.t_s > 10.5")
    page.page.click("#play")
    assert len(page.requests) == before and not page.problems


def test_it_plays_backwards_to_the_begin(opened):
    page = opened(LQR)
    page.ask("fulmar.timeline.seek(3)")
    page.page.select_option("#speed", "16")
    page.page.click("#back")
    page.until("fulmar.timeline.t_s === fulmar.timeline.begin_s && fulmar.timeline.direction === 0")
    assert not page.problems


def test_a_mark_says_what_happened_and_leads_there(opened):
    page = opened(LQR)
    page.ask("fulmar.timeline.seek(8)")
    mark = page.page.locator("#timeline .mark.goal").first
    assert "goal" in mark.get_attribute("title")
    mark.click()
    assert page.ask("fulmar.timeline.t_s") < 1.0
    assert "goal" in page.page.inner_text("#marked")


def test_two_bags_lie_in_one_scene_with_their_difference(opened):
    page = opened(LQR, POLICY)
    assert page.ask("[...fulmar.robots.values()].map((each) => each.name)") == [
        "A: floating_platform", "B: floating_platform",
    ]  # fmt: skip
    page.until("fulmar.plots.charts.has('A and B apart [m]')")
    page.page.select_option("#align", "goal")
    page.ask("fulmar.timeline.seek(5)")
    assert position(page, 0) != position(page, 1)
    assert not page.problems


def test_bags_of_different_robots_say_so(opened):
    page = opened(LQR, BAGS / "turtlebot2_go_to_position_policy")
    assert "different robots" in page.page.inner_text("#bagnotes")
    assert not page.ask("fulmar.plots.charts.has('A and B apart [m]')")


def test_how_to_compare_is_said_where_one_looks_for_it(opened):
    page = opened(LQR)
    page.page.click("#compare")
    assert f"fulmar console {LQR.name}" in page.page.inner_text("#marked")
