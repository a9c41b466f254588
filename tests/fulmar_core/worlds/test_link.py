"""Link between plant and controller: what is late, lost, held up and overtaken."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.worlds.by_kind import check_scenario
from fulmar_core.worlds.link import TO_CONTROLLER, TO_PLANT, Link, LinkDirection
from fulmar_core.worlds.scenario import load_scenario

MS = 1_000_000
PERIOD_NS = 20 * MS


def arrivals(link: Link, count: int = 2000, *, name: str = TO_PLANT, seed: int = 1) -> dict[int, int]:
    """When each message arrived [ns], of those that did; one is sent each 20 ms and looked for each ms."""
    direction: LinkDirection[int] = LinkDirection(link, name, message_bytes=100)
    direction.begin(seed, 0)
    found: dict[int, int] = {}
    for now_ns in range(0, (count + 100) * PERIOD_NS, MS):
        if now_ns % PERIOD_NS == 0 and now_ns // PERIOD_NS < count:
            direction.send(now_ns // PERIOD_NS, now_ns)
        for message in direction.arrived(now_ns):
            found[message] = now_ns
    assert direction.sent == count
    assert direction.lost == count - len(found)
    return found


def delays_ms(found: dict[int, int]) -> np.ndarray:
    return np.array([(at - message * PERIOD_NS) / MS for message, at in found.items()])


def test_a_message_is_late_by_the_delay_and_at_most_the_jitter() -> None:
    late = delays_ms(arrivals(Link(delay_s=0.08, jitter_s=0.02)))
    assert 60.0 <= late.min() < 62.0
    assert 98.0 < late.max() <= 101.0  # it is looked for each millisecond
    assert late.mean() == pytest.approx(84.0, abs=5.0)  # in order: some wait for those before


def test_as_many_messages_are_lost_as_the_file_says() -> None:
    assert 1.0 - len(arrivals(Link(loss=0.05))) / 2000 == pytest.approx(0.05, abs=0.015)


def test_messages_arrive_in_order_and_those_that_are_overtaken_are_lost_where_they_may_overtake() -> None:
    kept = arrivals(Link(delay_s=0.1, jitter_s=0.1))
    assert len(kept) == 2000
    assert list(kept) == sorted(kept)
    lossy = arrivals(Link(delay_s=0.1, jitter_s=0.1, reorder=True))
    assert list(lossy) == sorted(lossy)
    assert 500 < len(lossy) < 1900
    assert delays_ms(lossy).mean() < delays_ms(kept).mean()


def test_a_narrow_link_carries_no_more_than_its_bandwidth() -> None:
    found = arrivals(Link(bandwidth=20_000.0))  # 25 messages of 100 bytes a second, of 50 that are sent
    assert len(found) / 40.0 == pytest.approx(25.0, rel=0.1)
    assert delays_ms(found).max() <= 1050.0  # of a queue of a second


def test_a_seed_gives_the_same_link_and_each_direction_its_own() -> None:
    radio = load_scenario("radio").link
    assert radio == Link(delay_s=0.08, jitter_s=0.02, loss=0.05)
    again = [arrivals(radio), arrivals(radio), arrivals(radio, seed=2), arrivals(radio, name=TO_CONTROLLER)]
    assert again[0] == again[1]
    assert all(one != other for one, other in itertools.combinations(again[1:], 2))


def test_loss_changes_nothing_but_what_is_lost() -> None:
    whole = arrivals(Link(delay_s=0.08, jitter_s=0.005))
    lossy = arrivals(Link(delay_s=0.08, jitter_s=0.005, loss=0.3))
    assert all(whole[message] == at for message, at in lossy.items())


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"delay_s": 0.01, "jitter_s": 0.02}, "'jitter_s' = 0.02 must lie in"),
        ({"delay_s": -0.1}, "'jitter_s'"),
        ({"loss": 1.0}, "'loss' = 1 must lie in"),
        ({"bandwidth": -1.0}, "'bandwidth' = -1"),
    ],
)
def test_an_impossible_link_is_refused(parts: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Link(**parts)


@pytest.mark.parametrize(
    "robot", ["floating_platform", "kingfisher", "spacecraft_16", "cubesat_wheels", "airship_v7"]
)
def test_every_kind_of_robot_may_have_a_link(robot: str) -> None:
    check_scenario(load_robot(robot), "radio")


def test_an_unknown_key_of_a_link_is_refused_with_the_nearest_one(tmp_path, monkeypatch) -> None:
    folder = tmp_path / "scenarios"
    folder.mkdir()
    (folder / "wifi.yaml").write_text(
        "title: wifi\nsensor_noise: true\nbody: nominal\nlink: {delay: 0.1}\n", encoding="utf-8"
    )
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    with pytest.raises(ConfigError, match="delay_s"):
        load_scenario("wifi")
