"""Robots that run, on the console's page in a real browser: goals by the mouse, stops, and what is noticed when."""

from __future__ import annotations

import math
import signal
import time

import pytest

from fulmar_console.source import RobotSample
from tests.browser.pages import Page, started_browser, up
from tests.fulmar_console.served import served

pytestmark = pytest.mark.slow

DESK, TELEPHONE = (1280, 800), (390, 844)


@pytest.fixture
def browser():
    with started_browser() as browser:
        yield browser


@pytest.fixture
def running(tmp_path, ros_domain, browser):
    """Starts a system and opens its page: `running(*arguments)`."""
    with_all = []

    def start(*arguments, size=(640, 400)):
        system = up(tmp_path, ros_domain.id, *arguments)
        with_all.append(system)
        started = system.__enter__()
        page = Page(browser, f"{started.url}?plain", size)
        page.ready()
        return started, page

    yield start
    for system in reversed(with_all):
        system.__exit__(None, None, None)


def far_from(page, goal):
    x, y, z, *_ = page.ask("fulmar.scene.robots.get(fulmar.selected.index).body.group.position.toArray()")
    return math.dist((x, y, z), goal)


@pytest.mark.parametrize(
    ("arguments", "away", "within"), [(("mujoco_lqr",), 1.0, 0.15), (("--robot", "kingfisher"), 2.0, 0.4)]
)
def test_a_goal_that_is_dragged_over_the_ground_is_where_the_robot_goes(running, arguments, away, within):
    _, page = running(*arguments)
    x, y, z, *_ = page.ask("fulmar.handle.target")
    page.drag(page.screen([x, y, z]), page.screen([x + away, y, z]))
    page.until("fulmar.health.get(fulmar.selected.name).goal?.targets")
    goal = page.health()["goal"]["targets"][0][:3]
    assert math.dist(goal, (x + away, y, z)) < 0.3 * away  # as exactly as a hand aims
    page.until("fulmar.health.get(fulmar.selected.name).goal.distance_m < 0.5")
    end = time.monotonic() + 60.0
    while far_from(page, goal) > within and time.monotonic() < end:
        time.sleep(0.1)
    assert far_from(page, goal) <= within
    page.keep(f"goal_{arguments[-1]}")
    assert not page.problems


def pull(page, axis, pixels):
    """Pull one arrow of the handle: aim until it is under the mouse, as a person does."""
    number = "XYZ".index(axis)
    # At one moment: an aircraft is elsewhere in the next.
    centre, tip = page.ask(
        f"(() => {{ const a = fulmar.handle.target.slice(0, 3), b = [...a]; b[{number}] += 1;"
        "return [a, b].map((each) => (({x, y}) => ({x, y}))(fulmar.scene.screen(each))); })()"
    )
    far = math.hypot(tip["x"] - centre["x"], tip["y"] - centre["y"])
    way = {a: (tip[a] - centre[a]) / far for a in "xy"}
    for reach in range(16, 160, 4):
        at = {a: centre[a] + reach * way[a] for a in "xy"}
        page.page.mouse.move(at["x"], at["y"])
        time.sleep(0.02)
        if page.ask("fulmar.handle.controls.axis") == axis:
            page.drag(at, {a: at[a] + pixels * way[a] for a in "xy"})
            return
    raise AssertionError(f"no arrow {axis} was found under the mouse")


def test_a_spacecraft_goes_where_the_arrows_of_its_goal_are_pulled(running):
    _, page = running("--robot", "spacecraft_16", "--controller", "lqr", size=DESK)
    pull(page, "Z", 60)
    page.until("fulmar.health.get(fulmar.selected.name).goal?.targets")
    goal = page.health()["goal"]["targets"][0][:3]
    assert goal[2] > 0.1 and abs(goal[0]) < 0.05
    end = time.monotonic() + 90.0
    while far_from(page, goal) > 0.15 and time.monotonic() < end:
        time.sleep(0.1)
    assert far_from(page, goal) <= 0.15
    page.keep("goal_spacecraft")
    assert not page.problems


def test_an_aircraft_climbs_to_the_height_that_its_arrow_is_pulled_to(running):
    _, page = running("--robot", "airship_v7", size=DESK)
    pull(page, "Z", 40)
    page.until("fulmar.health.get(fulmar.selected.name).goal?.targets")
    height = page.health()["goal"]["targets"][0][2]
    end = time.monotonic() + 90.0
    while time.monotonic() < end:
        z = page.ask("fulmar.scene.robots.get(fulmar.selected.index).body.group.position.z")
        if abs(z - height) < 0.25:
            break
        time.sleep(0.1)
    assert abs(z - height) < 0.25
    page.keep("goal_aircraft")
    assert not page.problems


def test_a_stop_is_confirmed_and_a_reset_asks_first(running):
    _, page = running("mujoco_lqr", "--estop", size=DESK)
    page.ask("fulmar.feed.send({do: 'goal', robot: fulmar.selected.name, targets: [[2, 0, 0, 0, 0, 0, 1]]})")
    page.until("fulmar.scene.robots.get(fulmar.selected.index).shares.some((share) => share > 0)")
    page.page.click("#estop")
    page.until("document.getElementById('stopstate').textContent === 'Stopped'", within_s=1.0)
    assert "Stopped by the e-stop" in page.page.inner_text("#words")
    page.keep("stopped")
    page.page.click("#reset")
    assert page.page.is_visible("#ask")
    box = page.page.locator("#estop").bounding_box()  # still within reach while the question stands
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert page.ask(f"document.elementFromPoint({middle[0]}, {middle[1]}).id") == "estop"
    page.page.click("#ask button[value=no]")
    assert page.health()["estop"]
    page.page.click("#reset")
    page.page.click("#yes")
    page.until("!fulmar.health.get(fulmar.selected.name).estop", within_s=10.0)


def test_escape_stops_every_robot(running):
    _, page = running("mujoco_lqr")
    page.page.keyboard.press("Escape")
    page.until("fulmar.health.get(fulmar.selected.name).estop", within_s=2.0)


def test_two_pages_agree_and_the_last_goal_counts(running, browser):
    system, first = running("mujoco_lqr")
    second = Page(browser, f"{system.url}?plain")
    second.ready()
    goal = "fulmar.feed.send({do: 'goal', robot: fulmar.selected.name, targets: [[%s, 0, 0, 0, 0, 0, 1]]})"
    assert first.ask(goal % 1.0)["accepted"] and second.ask(goal % -1.0)["accepted"]
    for page in (first, second):
        page.until("fulmar.health.get(fulmar.selected.name).goal?.targets?.[0][0] === -1", within_s=5.0)
    first.page.click("#estop")
    second.until("document.getElementById('stopstate').textContent === 'Stopped'", within_s=2.0)


def test_a_console_that_hangs_greys_the_page_and_a_stop_is_not_confirmed(running):
    system, page = running("mujoco_lqr")
    console = system.console()
    console.send_signal(signal.SIGSTOP)
    try:
        page.until("document.body.classList.contains('stale')", within_s=2.0)
        assert "silent" in page.state()
        page.page.click("#estop")
        page.until(
            "document.getElementById('stopstate').textContent.startsWith('NOT CONFIRMED')", within_s=0.8
        )
        page.keep("not_confirmed")
    finally:
        console.send_signal(signal.SIGCONT)


def test_a_console_that_is_killed_is_started_again_and_the_page_comes_back(running):
    system, page = running("mujoco_lqr")
    page.ask("fulmar.feed.send({do: 'goal', robot: fulmar.selected.name, targets: [[1, 0, 0, 0, 0, 0, 1]]})")
    system.console().kill()
    page.until("document.body.classList.contains('stale')", within_s=2.0)
    page.until("!document.body.classList.contains('stale') && fulmar.health.size", within_s=30.0)
    page.until(
        "fulmar.health.get(fulmar.selected.name).goal?.distance_m < 0.5"
    )  # the robot went on meanwhile


def test_a_plant_that_hangs_is_said_and_a_stop_is_not_confirmed(running):
    system, page = running("mujoco_lqr")
    plant = system.plant()
    plant.send_signal(signal.SIGSTOP)
    try:
        page.page.click("#estop")
        page.until(
            "document.getElementById('stopstate').textContent.startsWith('NOT CONFIRMED')", within_s=0.9
        )
    finally:
        plant.send_signal(signal.SIGCONT)


def test_on_a_telephone_nothing_covers_the_stop(running):
    _, page = running("mujoco_lqr", size=TELEPHONE)
    page.keep("telephone")
    box = page.page.locator("#estop").bounding_box()
    assert box["height"] >= 44 and box["x"] >= 0 and box["x"] + box["width"] <= TELEPHONE[0]
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert page.ask(f"document.elementFromPoint({middle[0]}, {middle[1]}).id") == "estop"
    assert page.ask("document.documentElement.scrollWidth") <= TELEPHONE[0]


def test_without_webgl_one_notice_says_so_and_the_stop_works(tmp_path, ros_domain):
    from playwright.sync_api import sync_playwright

    from tests.browser.pages import CHROMIUM

    with up(tmp_path, ros_domain.id, "mujoco_lqr") as system, sync_playwright() as play:
        browser = play.chromium.launch(
            executable_path=CHROMIUM,
            args=["--no-sandbox", "--disable-gpu", "--disable-webgl", "--disable-webgl2"],
        )
        page = Page(browser, system.url)
        page.until("fulmar.health.get('floating_platform')?.plant_mode === 'running'")
        assert "WebGL" in page.page.inner_text("#notice")
        page.page.click("#estop")
        page.until("document.getElementById('stopstate').textContent === 'Stopped'", within_s=3.0)
        browser.close()


def test_a_page_that_was_open_while_the_console_became_another_version_says_so(browser):
    with served() as console:
        page = Page(browser, console.origin)
        page.until("fulmar.frames > 2")
        vars(console.server._pages)["version"] = "newer"
        console.drop_pages()
        page.until("!document.getElementById('notice').hidden && fulmar.feed.open", within_s=20.0)
        assert "another version" in page.page.inner_text("#notice") and page.page.is_visible("#notice button")


def test_a_key_that_is_let_go_with_shift_pressed_no_longer_drives(browser):
    with served() as console:
        page = Page(browser, f"{console.origin}?plain")
        page.until("window.fulmar?.frames > 3 && fulmar.selected")
        page.ask("fulmar.driving.build([{name: 'ahead', keys: 'ws', words: 'ahead and back'}])")
        page.ask("document.getElementById('chosen').querySelector('details').open = true")
        page.ask("document.getElementById('drive').open = true")
        keyboard = page.page.keyboard
        keyboard.down("w")
        page.until("fulmar.driving.held.has('w')", within_s=2.0)
        keyboard.down("Shift")
        keyboard.up("W")
        page.until("fulmar.driving.held.size === 0", within_s=2.0)


def test_a_robot_whose_poses_grow_old_is_named_beside_the_stop(browser):
    with served() as console:
        console.source.health = lambda: {"boat": {"plant_mode": "running", "level": "ok", "words": ""}}
        page = Page(browser, f"{console.origin}?plain")
        page.until("window.fulmar?.frames > 3 && document.getElementById('stopstate').className === 'ok'")
        console.source.frame = lambda: ([RobotSample(0, 1.1, (1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0), ())], 0.0)
        page.until("fulmar.stale.includes('boat')", within_s=2.0)
        assert "boat" in page.state()
