"""Commands that actuators cannot follow."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from tests.fulmar_core.safety.guards import BASE, GOOD, MS, NAMES


class TestSlew:
    """Commands that actuators cannot follow are brought nearer to the one before."""

    @pytest.mark.parametrize(("lockstep", "goes_on"), [(True, True), (False, False)])
    def test_only_in_lock_step_a_late_answer_goes_on_from_the_command_before(self, lockstep, goes_on):
        guard = ActuatorGuard(BASE, Watchdog(400 * MS), control_dt=0.1, lockstep=lockstep)
        for k in range(1, 10):
            guard.offer(BASE.names, [0.05 * k, 0.0], k * MS, stamp_ns=k)
        before = guard.command[0]
        guard.offer(BASE.names, [before, 0.0], 5_000 * MS, stamp_ns=10)
        assert bool(guard.command[0] == before) is goes_on

    def test_a_step_is_cut_to_what_one_control_period_allows(self, base):
        base.offer(BASE.names, [0.45, 0.0], 0, stamp_ns=100 * MS)
        assert base.output(1)[0] == pytest.approx(0.09)

    def test_who_sends_faster_gets_no_more_in_the_same_time(self, base):
        base.offer(BASE.names, [0.0, 0.0], 0)
        for t in range(1, 101):
            base.offer(BASE.names, [0.45, 0.0], t * MS)
        assert base.output(101 * MS)[0] == pytest.approx(0.09, rel=1e-3)

    def test_a_command_within_the_limit_stays_as_it_is_to_the_last_bit(self, base):
        values = [0.1 * 0.9 / 1.7, 0.1 * 1.8 / 3.3]
        base.offer(BASE.names, values, 0, stamp_ns=100 * MS)
        assert base.output(1).tolist() == values

    def test_after_an_e_stop_wheels_begin_anew_from_where_they_slowed_down_to(self, base):
        for k in range(6):
            base.offer(BASE.names, [0.45, 0.0], 100 * k * MS, stamp_ns=(100 + 100 * k) * MS)
        assert base.output(501 * MS)[0] == pytest.approx(0.45)
        base.estop.receive(True, 510 * MS)
        assert base.output(520 * MS)[0] > 0.4
        assert base.output(620 * MS)[0] == pytest.approx(0.45 - 0.09, abs=0.02)
        assert base.output(1200 * MS)[0] == 0.0

    @pytest.mark.parametrize("rate", [1, 2, 4])
    def test_commands_without_stamps_are_slewed_by_the_time_of_the_plant(self, base, rate):
        """At rate 4 a control period takes a quarter of it by the steady clock."""
        for k in range(6):
            base.offer(BASE.names, [0.45, 0.0], 100 * k * MS // rate, plant_ns=100 * k * MS)
        assert base.command[0] == pytest.approx(0.45)

    def test_commands_by_hand_are_slewed_by_the_time_of_the_plant_too(self, base):
        for k in range(6):
            base.offer_by_hand(BASE.names, [0.45, 0.0], 25 * k * MS, plant_ns=100 * k * MS)
        assert base.command[0] == pytest.approx(0.45)

    def test_a_plant_whose_time_stands_still_moves_no_actuator_on(self, base):
        for k in range(6):
            base.offer(BASE.names, [0.45, 0.0], 100 * k * MS, plant_ns=0)
        assert base.command[0] == pytest.approx(0.09)

    def test_valves_have_no_slew(self, guard):
        guard.offer(NAMES, GOOD, 0)
        assert guard.output(1).tolist() == GOOD


class TestAStopThatEndsEarly:
    """The e-stop node was lost, and is there again before the wheels stand."""

    @pytest.mark.parametrize("commanded_then", [0.0, 0.45])
    def test_the_wheels_go_on_from_where_it_brought_them(self, base, commanded_then):
        base.estop.receive(False, 0)
        speeds = []
        for now in range(0, 1300, 20):
            if now % 100 == 0:
                wanted = [0.45 if now <= 500 else commanded_then, 0.0]
                base.offer(BASE.names, wanted, now * MS, stamp_ns=(1 + now) * MS)
            if not 0 < now < 700:
                base.estop.receive(False, now * MS)
            speeds.append(float(base.output(now * MS)[0]))
        stopped, again = 520 // 20, 700 // 20
        assert speeds[stopped - 1] == pytest.approx(0.45)
        assert 0.2 < speeds[again] < 0.3
        most = 0.09 if commanded_then else 0.0  # m/s: a control step's
        assert max(np.diff(speeds[stopped:])) <= most + 1e-9
        assert speeds[-1] == pytest.approx(commanded_then)

    def test_valves_stay_closed_until_the_next_command(self, guard):
        guard.estop.receive(False, 0)
        for now in range(0, 510, 100):
            guard.offer(NAMES, GOOD, now * MS)
        assert guard.output(501 * MS).tolist() == [0.0] * 8
        guard.estop.receive(False, 520 * MS)
        assert guard.output(530 * MS).tolist() == [0.0] * 8
        guard.offer(NAMES, GOOD, 540 * MS)
        assert guard.output(550 * MS).tolist() == GOOD
