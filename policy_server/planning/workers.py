"""Plans are made beside the control loop: CasADi lets go of the interpreter while IPOPT works."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor

from policy_server.planning.program import Drive, Program
from policy_server.planning.reference import Follower, Reference
from policy_server.planning.search import Guess, Order, Search


class Solvers:
    """Threads that make guesses quick; each has a program of its own, written when it is first needed."""

    def __init__(self, make: Callable[[], Program], count: int | None = None) -> None:
        """Begin none yet.

        Args:
            make: Writes a program; takes seconds.
            count: Threads at most; one for each core that we may use by default.
        """
        self._make, self._own = make, threading.local()
        self._pool = ThreadPoolExecutor(count or len(os.sched_getaffinity(0)), thread_name_prefix="solver")

    def warm_up(self) -> None:
        """Have one thread ready, so that the first plan does not wait for it."""
        self._pool.submit(self._program).result()

    def __call__(self, guesses: Iterable[Guess]) -> Iterable[Drive | None]:
        """As `search.Solve`."""
        return self._pool.map(self._solve, guesses)

    def _solve(self, guess: Guess) -> Drive | None:
        return self._program().solve(guess.drive, guess.course, wanted=guess.wanted, reach=guess.reach)

    def _program(self) -> Program:
        if not hasattr(self._own, "program"):
            self._own.program = self._make()
        program: Program = self._own.program
        return program


class Planning:
    """One thread that searches while the robot drives."""

    def __init__(self, search: Search, follower: Follower) -> None:
        """What it works with; nobody else's."""
        self._search, self._follower = search, follower
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="planner")

    def begin(self, orders: list[Order]) -> Future[list[Reference | None]]:
        """Have plans made.

        Returns:
            What to follow for each order; None where there is no plan.
        """
        return self._pool.submit(self._work, orders)

    def _work(self, orders: list[Order]) -> list[Reference | None]:
        drives = self._search.plans(orders)
        return [None if drive is None else self._follower.of_drive(drive) for drive in drives]
