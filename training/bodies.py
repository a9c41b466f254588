"""Bodies that differ from world to world, for networks that ask for a wrench: allocations, and what a network sees."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import torch

from fulmar_core.controllers.wrench_shares import WrenchShares, body_terms
from fulmar_core.robots.robot import Robot
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.worlds.scenario import Scenario
from fulmar_core.worlds.shaped_world import BRANCH, Bodies, draw_bodies


class KnownBodies:
    """Allocation and terms of a robot's body, or of that of each world.

    Attributes:
        shares: Allocation, as float32 tensors.
        terms: `WrenchShares.accelerations`, shape (6,) or (worlds, 6), float32.
    """

    def __init__(self, shares: WrenchShares, terms: np.ndarray) -> None:
        parts = (getattr(shares, each.name) for each in fields(shares))
        self.shares = WrenchShares(*(torch.from_numpy(part.astype(np.float32)) for part in parts))
        self.terms = terms.astype(np.float32)

    @classmethod
    def of_robot(cls, robot: Robot) -> KnownBodies:
        """The body of a robot's file.

        Raises:
            ValueError: As in `WrenchShares.of_robot`.
        """
        return cls(WrenchShares.of_robot(robot), body_terms(robot))

    @classmethod
    def of(cls, effect: np.ndarray, mass: np.ndarray, moments: np.ndarray) -> KnownBodies:
        """Of bodies.

        Args:
            effect: As in `WrenchShares.of`, shape (worlds, 6, n).
            mass: Shape (worlds,) [kg].
            moments: Of inertia, shape (worlds, 3) [kg·m²].
        """
        shares = WrenchShares.of(effect)
        return cls(shares, shares.accelerations(mass, moments))

    @classmethod
    def of_bodies(cls, bodies: Bodies) -> KnownBodies:
        """Of drawn bodies."""
        return cls.of(bodies.effect, bodies.mass, bodies.inertia[:, :3])

    @classmethod
    def of_worlds(cls, robot: Robot, world: Any, worlds: np.ndarray | None = None) -> KnownBodies:
        """Of some worlds of a simulation, all by default; one for all where every world has the robot's own body."""
        if world.effects is None:
            return cls.of_robot(robot)
        some = world if worlds is None else world[worlds]
        effect = np.moveaxis(np.asarray(some.effects, dtype=float), (0, 1), (-1, -2))
        return cls.of(effect, np.asarray(some.mass, float), np.asarray(some.inertia[:3], float).T)

    @classmethod
    def of_episodes(cls, robot: Robot, scenario: Scenario, *, seed: int, numbers: np.ndarray) -> KnownBodies:
        """Of the episodes of a seed that a scenario draws."""
        if scenario.body != "morphology":
            return cls.of_robot(robot)
        draws = Draws(seed, numbers, np.zeros_like(numbers), WORLD).branch(BRANCH)
        return cls.of_bodies(draw_bodies(robot, draws))

    def write(self, worlds: np.ndarray, others: KnownBodies) -> None:
        """Overwrite some worlds, in place."""
        if self.terms.ndim == 1:
            return
        index = torch.as_tensor(worlds)
        for each in fields(self.shares):
            getattr(self.shares, each.name)[index] = getattr(others.shares, each.name)
        self.terms[worlds] = others.terms
