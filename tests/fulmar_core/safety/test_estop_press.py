"""Who pressed the e-stop: by its own claim, by that of a node that passes it on, or by the graph."""

from __future__ import annotations

from fulmar_core.safety.estop_press import CLAIM_NS, LOOK_NS, EstopPress

S = 1_000_000_000


def pressed() -> EstopPress:
    press = EstopPress()
    assert press.press(10 * S)
    return press


def test_without_a_press_no_claim_counts():
    press = EstopPress()
    press.claim("/alice on lab", 10 * S)
    assert press.by == ""


def test_a_claim_just_before_or_just_after_a_press_names_who_pressed():
    for claimed_ns in (10 * S - CLAIM_NS, 10 * S + CLAIM_NS):
        press = EstopPress()
        if claimed_ns < 10 * S:
            press.claim("/alice on lab", claimed_ns)
        press.press(10 * S)
        if claimed_ns > 10 * S:
            press.claim("/alice on lab", claimed_ns)
        assert press.by == "/alice on lab"


def test_a_claim_from_long_before_a_press_names_nobody_and_the_graph_is_asked():
    press = EstopPress()
    press.claim("/alice on lab", 10 * S - CLAIM_NS - 1)
    press.press(10 * S)
    assert press.by == ""
    press.look(lambda: (["/stranger"], True), 10 * S)
    assert press.by == "/stranger"


def test_the_first_press_and_the_first_claim_count():
    press = pressed()
    press.claim("/alice on lab", 10 * S)
    press.claim("/bob on lab", 10 * S + 1)
    assert not press.press(11 * S)
    assert press.by == "/alice on lab"


def test_who_calls_the_service_counts_before_the_node_that_passes_the_press_on():
    press = pressed()
    press.claim("/robot/estop on lab, by its service", 10 * S, passes_on=True)
    assert press.by == "/robot/estop on lab, by its service"
    press.claim("/alice on lab", 10 * S)
    assert press.by == "/alice on lab"


def test_of_two_publishers_both_are_named():
    press = pressed()
    press.look(lambda: (["/a", "/b"], True), 10 * S)
    assert press.by == "one of /a, /b"


def test_the_graph_is_asked_until_every_publisher_has_a_name_or_it_is_too_late():
    press = pressed()
    press.look(lambda: (["a node of unknown name"], False), 10 * S)
    press.look(lambda: (["/a"], True), 10 * S + 1)
    assert press.by == "/a"
    press.look(lambda: (["/b"], True), 10 * S + 2)
    assert press.by == "/a"
    late = pressed()
    late.look(lambda: (["/a"], True), 10 * S + LOOK_NS + 1)
    assert late.by == ""


def test_a_publisher_that_is_gone_at_a_later_look_stays_named():
    press = pressed()
    press.look(lambda: (["/a", "a node of unknown name"], False), 10 * S)
    press.look(lambda: ([], True), 10 * S + 1)
    assert press.by == "one of /a, a node of unknown name"


def test_a_reset_forgets_who_pressed():
    press = pressed()
    press.claim("/alice on lab", 10 * S)
    press.release()
    assert press.by == ""
    press.press(10 * S + 1)
    assert press.by == ""
