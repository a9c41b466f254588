"""Rows of the catalogue: each benchmark with its words, its selectors, and what it needs."""

from __future__ import annotations

from pathlib import Path

from fulmar_benchmarks.catalogue import Row, Selector

POLICY = Selector("policy", "DIR", "A policy bundle; the shipped one by default.", None, Path)
SCENARIO = Selector("scenario", "NAME", "Disturbances: a name from configs/scenarios.", "nominal")

INERTIA = Row(
    "inertia",
    "fulmar_benchmarks.inertia.campaign:Inertia",
    """Estimate the inertia of three satellites under nine excitations, beside thesis Figs. 6.8 and 6.9.

    Each run lasts 300 s, from rest, sampled at 10 Hz; profiles have the amplitudes of the study (arXiv 2510.16738), so
    that some wheels run at their top speed. Estimators: batch least squares (ls), least squares with forgetting (rls)
    and an extended Kalman filter (ekf), which begin at 0.8 or 0.85 of the truth. `error_max` is the largest relative
    error of a moment, `saturated` the share of the time with a wheel at its top speed. `dynamic` has an inertia that
    steps by 10 % at half time, drifts by 5 %, or swings by 3 % in 50 s. It takes two minutes on two cores.

    Try:

    fulmar benchmark inertia --satellites microsat --profiles chirp,persistent --json
    """,
    (
        Selector("satellites", "S,...", "Out of cubesat_wheels, microsat and smallsat, or all.", "all",
                 family="satellite", known="fulmar_benchmarks.inertia.campaign:SATELLITES"),
        Selector("profiles", "P,...", "Out of the eight of the study and `persistent`, our own, or all.", "all",
                 family="profile", known="fulmar_benchmarks.inertia.campaign:PROFILES"),
        Selector("draws", "N", "Draws of sensor noise for each static cell; the worst counts.", 3, int, 1,
                 names=("--draws", "--episodes")),
    ),
    measures="satellites",
)  # fmt: skip

ROWS = (INERTIA,)
