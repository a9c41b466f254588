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

EVENTS = Row(
    "events",
    "fulmar_benchmarks.events.campaign:Events",
    """Estimate turn rates from simulated events of real stars, beside thesis Table 6.2.

    Cameras of 8.5° and 1024 × 1024 pixels see stars to magnitude 7; pixels have a threshold of 0.25 ± 0.03, 0.1 Hz of
    noise and time stamps that jitter by 100 µs. Attitudes are random, rates from 0.1 to 2 °/s about any axis. No search
    starts at the truth. Errors are in °/s about the first camera's axes: p and q across its boresight, r about it.
    `nees_inside` is the share of windows whose normalised error squared is below the 95 % limit of chi-squared with
    three degrees of freedom. `pointing` is a satellite that goes on pointing to the nadir when its gyroscope dies.

    Try:

    fulmar benchmark events --runs 20 --parts table,fields --json
    """,
    (
        Selector("runs", "N", "Random windows, of the table and of each field of view.", 100, int, 4,
                 names=("--runs", "--episodes")),
        Selector("parts", "P,...", "Out of table, fields (of view), sensitivity, slow_and_fast and pointing, or all.",
                 "all", family="part", known="fulmar_benchmarks.events.campaign:PARTS"),
        Selector("pointing_runs", "N", "Episodes of nadir pointing without a gyroscope, 3 min of a core each.", 2,
                 int, 1),
        Selector("pointing_s", "S", "Length of these episodes [s].", 600.0, float, 120.0),
    ),
    needs=lambda choice: ("mujoco",),
    measures="windows",
)  # fmt: skip

ROWS = (EVENTS, INERTIA)
