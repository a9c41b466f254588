"""The emergency stop: monitor and button, with injected time."""

from __future__ import annotations

from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from fulmar_core.safety.estop import QUIET_NS, TIMEOUT_NS, EstopButton, EstopMonitor

MS = 1_000_000


def test_without_an_estop_and_no_requirement_everything_may_move():
    assert EstopMonitor(required=False).reason(0) == ""


def test_a_required_estop_stops_everything_until_it_is_received():
    monitor = EstopMonitor(required=True)
    assert "none is received" in monitor.reason(0)
    monitor.receive(False, 5)
    assert monitor.reason(6) == ""


def test_one_press_holds_although_the_node_goes_on_saying_released():
    monitor = EstopMonitor(required=False)
    monitor.receive(False, 0)
    monitor.receive(True, 10 * MS)
    for t in range(100, 5000, 100):
        monitor.receive(False, t * MS)
        assert "pressed" in monitor.reason(t * MS)
    monitor.release(5000 * MS)
    assert monitor.reason(5000 * MS) == ""


def test_one_press_without_any_node_holds_until_a_reset_and_needs_no_node_then():
    monitor = EstopMonitor(required=False)
    monitor.receive(True, 0)
    assert "pressed" in monitor.reason(1)
    assert "pressed" in monitor.reason(3_600_000 * MS)
    monitor.release(3_600_000 * MS)
    assert monitor.reason(7_200_000 * MS) == ""
    assert not monitor.received


def test_a_press_of_another_publisher_shows_no_node_where_one_is_required():
    monitor = EstopMonitor(required=True)
    monitor.receive(True, 0)
    monitor.release(1)
    assert "none is received" in monitor.reason(2)
    monitor.receive(False, 3)
    assert monitor.reason(4) == ""


def test_a_press_right_after_a_reset_holds():
    monitor = EstopMonitor(required=False)
    monitor.receive(True, 0)
    monitor.release(1)
    monitor.receive(True, 2)
    monitor.receive(False, 3)
    assert "pressed" in monitor.reason(4)


def test_silence_beyond_the_timeout_stops_also_where_none_was_required():
    monitor = EstopMonitor(required=False)
    monitor.receive(False, 0)
    assert monitor.reason(TIMEOUT_NS) == ""
    assert "silent for" in monitor.reason(TIMEOUT_NS + MS)


def test_a_reset_does_not_end_the_silence_that_follows_it():
    monitor = EstopMonitor(required=False)
    monitor.receive(False, 0)
    monitor.receive(True, 100 * MS)
    monitor.release(200 * MS)
    assert monitor.reason(200 * MS) == ""
    assert "silent for" in monitor.reason(701 * MS)


def test_a_reset_without_a_node_ends_the_silence_of_one_that_is_gone():
    monitor = EstopMonitor(required=False)
    monitor.receive(False, 0)
    assert "silent for" in monitor.reason(600 * MS)
    monitor.release(600 * MS)
    assert monitor.reason(5000 * MS) == ""


def test_a_reset_without_a_node_does_not_do_where_one_is_required():
    monitor = EstopMonitor(required=True)
    monitor.receive(False, 0)
    monitor.release(600 * MS)
    assert "none is received" in monitor.reason(600 * MS)


def test_of_two_buttons_the_pressed_one_counts():
    monitor = EstopMonitor(required=False)
    for t in range(0, 2000, 100):
        monitor.receive(True, t * MS)
        monitor.receive(False, (t + 10) * MS)
        assert monitor.reason((t + 20) * MS)


def test_a_press_outlives_its_node_until_a_reset():
    monitor = EstopMonitor(required=False)
    monitor.receive(False, 0)
    monitor.receive(True, 100 * MS)
    for t in range(3000, 6000, 100):  # started again, the node does not know of the press
        monitor.receive(False, t * MS)
        assert "Reset it" in monitor.reason(t * MS)
    monitor.release(6000 * MS)
    assert monitor.reason(6000 * MS) == ""


def test_a_button_that_was_silent_for_a_while_but_not_pressed_is_believed_again():
    monitor = EstopMonitor(required=False)
    monitor.receive(False, 0)
    assert monitor.reason(3000 * MS)
    monitor.receive(False, 3000 * MS)
    assert monitor.reason(3000 * MS) == ""


def test_the_button_stays_pressed_until_it_is_reset():
    button = EstopButton()
    button.press()
    assert button.pressed
    assert button.reset(0) == ""
    assert not button.pressed


def test_a_reset_is_refused_while_somebody_commands_motion():
    button = EstopButton()
    button.press()
    button.receive_command("cmd_vel", False, 0)
    assert "cmd_vel is not zero" in button.reset(QUIET_NS)
    assert button.pressed
    button.receive_command("cmd_vel", True, QUIET_NS)
    assert button.reset(QUIET_NS + 1) == ""


def test_a_source_that_has_fallen_silent_does_not_hold_a_reset_up_for_ever():
    button = EstopButton()
    button.press()
    button.receive_command("cmd_vel", False, 0)
    assert button.reset(QUIET_NS + 1) == ""


def test_one_quiet_source_does_not_hide_another_that_is_not():
    button = EstopButton()
    button.press()
    button.receive_command("teleop/command", False, 0)
    button.receive_command("actuators/command", True, 1)
    assert "teleop/command" in button.reset(2)


@given(
    st.lists(
        st.tuples(st.sampled_from(("press", "false", "reset")), st.integers(1, 400)), min_size=1, max_size=40
    ),
    st.integers(0, 2000),
)
@hypothesis_settings(max_examples=100, deadline=None)
def test_nothing_moves_after_a_press_before_a_reset_whatever_else_is_said(messages, later_ms):
    monitor, now, pressed = EstopMonitor(required=False), 0, False
    for said, gap_ms in messages:
        now += gap_ms * MS
        if said == "reset":
            monitor.release(now)
            pressed = False
        else:
            monitor.receive(said == "press", now)
            pressed = pressed or said == "press"
    now += later_ms * MS
    moves = monitor.reason(now) == ""
    assert not (moves and pressed)
    if later_ms * MS > TIMEOUT_NS:
        assert not (moves and monitor.received)


def test_it_knows_whether_it_was_ever_released():
    monitor = EstopMonitor(required=True)
    monitor.receive(True, 0)
    assert not monitor.was_released
    monitor.receive(False, 1)
    assert not monitor.was_released
    monitor.release(2)
    monitor.receive(False, 3)
    assert monitor.was_released
    assert EstopMonitor(required=False).was_released
