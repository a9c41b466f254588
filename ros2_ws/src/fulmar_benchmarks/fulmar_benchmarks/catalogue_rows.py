"""Rows of the catalogue: benchmarks beside published results; each with its words, selectors, and what it needs."""

from __future__ import annotations

from pathlib import Path

from fulmar_benchmarks.catalogue_own import (
    CONSOLE,
    DESCENT,
    ENDURANCE,
    EVERY,
    FLIGHTS,
    GUARD,
    LATENCY,
    PACE,
    POLICY,
    SCENARIO,
    THROUGHPUT,
    TRAINING,
)
from fulmar_benchmarks.selectors import Row, Selector

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

FALCON = Row(
    "falcon",
    "fulmar_benchmarks.falcon.campaign:Falcon",
    """Fly a ground-effect craft along the references of the thesis, beside its Tables 5.2 and 5.6 to 5.8.

    Flights of 60 s in the core's dynamics: `hold` one metre over the water, and (a) to (f) of thesis §5.5.2. Scenarios:
    exact (state as it is), calm (sensors of 100 Hz with 0.05 m, 0.05 m/s, 0.01 rad, 0.01 rad/s), calm with twice the
    noise, measurements (`delay`) or commands (`late`) that are 20 ms late, light or severe Dryden turbulence, or noise,
    delay and light turbulence in `all`. `rmse_per_axis_m` is √(mean e² / 3), as the thesis prints it, `rmse_m` √(mean
    e²), `peak_error_m` the largest distance (`overshoot_m` in the thesis), `energy` the mean squared throttle,
    `energy_per_m` [s/m] that over the speed, medians over the flights that survive, and `wall_s` what the flights of a
    cell took side by side. The `usual` scenarios are exact, calm, light and severe of lqr and pid, exact of mppi, in 5
    flights that differ by the seeds of its noise, and all of them of lqi and policy. A flight survives if the hull
    touches no water and no angle of attack goes beyond 1.5 times the stall's.

    Try:

    fulmar benchmark falcon --tasks a,d --controllers lqi --scenarios exact,calm --json

    fulmar benchmark falcon --tasks hold --controllers policy --scenarios calm,light --episodes 256

    fulmar benchmark falcon --tasks a,b,c,d,e,f --controllers lqi,mppi,pid --scenarios exact
    """,
    (
        Selector("robot", "NAME", "An aircraft.", "airship_v7"),
        Selector("tasks", "T,...", "Out of hold and a to f, or all.", "all",
                 family="task", known="fulmar_benchmarks.falcon.cells:TASKS"),
        Selector("controllers", "C,...", "Out of lqi, lqr, mppi, pid and policy, or all.", "all",
                 family="controller", known="fulmar_benchmarks.falcon.cells:CONTROLLERS"),
        Selector("scenarios", "S,...",
                 "Out of exact, calm, noise, delay, late, light, severe and all, or every, or usual.", "usual",
                 family="scenario", known="fulmar_benchmarks.falcon.cells:SCENARIOS", every="every", nothing="usual"),
        Selector("episodes", "N", "Flights of each cell; 1 with exact state on a path, at most 5 of mppi.", 20, int, 1),
        POLICY,
    ),
    measures="flights",
)  # fmt: skip

DRIFT = Row(
    "drift",
    "fulmar_benchmarks.drift.campaign:Drift",
    """Run the experiment of thesis Tables 3.5 and 3.6, and print both side by side.

    Nine conditions of 256 trajectories from 3 to 4 m away, 250 steps of 0.2 s each, and three paths at 0.2 m/s; in
    MuJoCo, through the deployed nodes. DIR keeps results for the same code, configuration and controller, so an
    interrupted benchmark continues where it stopped. DIR/index.html is the report, DIR/drift.json the figures.

    Try:

    fulmar benchmark drift --rows ideal,torque --controllers lqr --through mujoco
    """,
    (
        Selector("through", "batch|mujoco|ros", "ros: the deployed nodes over DDS, in lock step.", "ros",
                 family="way", known="fulmar_evaluation.evaluation:WAYS", single=True),
        Selector("controllers", "K,...", "Out of policy and the classical controllers.", "policy,lqr",
                 family="controller", known="policy_server.controllers:CONTROLLERS", without=("classical",),
                 as_given=True),
        Selector("rows", "R,...", "Names of conditions and paths; all twelve by default.", family="row",
                 known="fulmar_benchmarks.drift.conditions:ROWS", usual="fulmar_benchmarks.drift.conditions:ROWS"),
        Selector("episodes", "N", "Trajectories of each condition; paths have at most 4.", 256, int, 1),
        POLICY,
        Selector("tracking_policy", "DIR", "Policy bundle for the paths; the shipped one by default.", None, Path),
    ),
    needs=lambda choice: (
        *(("onnxruntime",) * ("policy" in choice.controllers)), *(("mujoco",) * (choice.through != "batch")),
    ),
    measures="evaluating",
)  # fmt: skip

POLICIES = Selector(
    "policies", "DIR", "Folder of bundles named ROBOT_TASK; the shipped ones by default.", None, Path
)
RANS3D = Row(
    "rans3d",
    "fulmar_benchmarks.rans3d.campaign:Rans3d",
    """Evaluate the controllers of bodies in space at the 3-D tasks of RANS, in MuJoCo.

    Beside success and errors of spacecraft_16 and int_ball2, nominal and randomised: thrusters that are dead, what the
    integrator keeps of a torque-free tumble, and the pace of the batch beside MuJoCo's rollout. A bundle that does not
    exist leaves its cells empty and says how to make it. int_ball2 starts up to 2 m away and has 60 s. DIR keeps
    results for the same code, configuration and controller, so an interrupted benchmark continues where it stopped.
    DIR/index.html is the report, DIR/rans3d.json the figures.

    Try:

    fulmar benchmark rans3d --robots spacecraft_16 --tasks go_to_pose_3d --parts tasks,integrator
    """,
    (
        Selector("robots", "R,...", "Out of spacecraft_16 and int_ball2, or all.", "all",
                 family="robot", known="fulmar_benchmarks.rans3d.targets:ROBOTS"),
        Selector("tasks", "T,...", "Out of the five tasks that end in _3d, or all.", "all",
                 family="task", known="fulmar_benchmarks.rans3d.targets:TASKS"),
        Selector("controllers", "K,...", "Out of lqr, pd and policy, or all.", "all",
                 family="controller", known="fulmar_benchmarks.rans3d.targets:CONTROLLERS"),
        Selector("scenarios", "S,...", "Out of nominal and randomised, or all.", "all",
                 family="scenario", known="fulmar_benchmarks.rans3d.targets:SCENARIOS"),
        Selector("parts", "P,...", "Out of tasks, dead (thrusters), integrator and throughput, or all.", "all",
                 family="part", known="fulmar_benchmarks.rans3d.targets:PARTS"),
        POLICIES,
        Selector("episodes", "N", "Of each controller at each task and scenario.", 256, int, 1),
        Selector("tumble_s", "S", "Length of the tumble by which the integrator is measured [s].", 3600.0, float, 1.0),
        Selector("worlds", "N", "Worlds of the batch whose pace is measured.", 4096, int, 1),
        Selector("seconds", "S", "Time of each measurement of the pace [s].", 1.0, float, 0.05),
    ),
    needs=lambda choice: ("mujoco", *(("onnxruntime",) * ("policy" in choice.controllers))),
    measures="evaluating",
)  # fmt: skip

AVIST = Row(
    "avist",
    "fulmar_benchmarks.avist.campaign:Avist",
    """Evaluate a cubesat at the tasks of RL-AVIST, by laws and by policies.

    Every controller at every task in MuJoCo (part `tasks`), the policy that follows a moving pose through live nodes
    in lock step, in at most 64 episodes (`live`), and every controller one round along every path about every thing
    (`inspect`). Two parts learn for hours, and are asked for by name: `learners` teaches PPO, TD3, SAC and DreamerV3
    (after `make dreamer`) to follow a pose, each with as many samples and as much processor time; `generalists`
    compares policies for all paths, or for bodies of any mass, size and layout of thrusters, with others that learn for
    one, in as many updates each. A bundle that does not exist leaves its cells empty and says how to make it. The
    thesis, §6.2, prints no numbers; what its code sets stands in `published`. DIR keeps results for the same code,
    configuration and controller, so an interrupted benchmark continues where it stopped. DIR/index.html is the report,
    DIR/avist.json the figures.

    Try:

    fulmar benchmark avist --parts tasks --tasks go_to_pose_3d --controllers lqr,pd --json

    fulmar benchmark avist --parts inspect --things gateway --paths circle,spiral --rounds 2

    fulmar benchmark avist --parts learners --learners ppo,td3 --cpu-s 300 --samples 50000
    """,
    (
        Selector("robot", "NAME", "A body that floats free.", "cubesat_8"),
        Selector("tasks", "T,...", "Out of its tasks, or all.", "all",
                 family="task", known="fulmar_benchmarks.avist.targets:TASKS"),
        Selector("controllers", "K,...", "Out of lqr, pd and policy, or all.", "all",
                 family="controller", known="fulmar_benchmarks.avist.targets:CONTROLLERS"),
        Selector("things", "T,...", "That are inspected; generalists learn about the first.", "all",
                 family="thing", known="fulmar_benchmarks.avist.targets:THINGS"),
        Selector("paths", "P,...", "That are followed about them.", "all",
                 family="path", known="fulmar_benchmarks.avist.targets:PATHS"),
        Selector("parts", "P,...", "Out of tasks, live, inspect, learners and generalists; the first three by default.",
                 None, family="part", known="fulmar_benchmarks.avist.targets:ALL_PARTS",
                 usual="fulmar_benchmarks.avist.targets:PARTS"),
        Selector("learners", "L,...", "Out of ppo, td3, sac and dreamer, or all.", "all",
                 family="learner", known="fulmar_benchmarks.avist.learners:LEARNERS"),
        Selector("seeds", "N", "Of each learner, from 1 on.", 2, int, 1),
        Selector("samples", "N", "Control steps at which learners are compared.", 12_000, int, 1),
        Selector("cpu_s", "S", "Processor time of each learner and seed.", 1800.0, float, 1.0),
        POLICIES,
        Selector("episodes", "N", "Of each controller at each task.", 256, int, 1),
        Selector("rounds", "N", "Flights of each controller along each path about each thing.", 20, int, 1),
        Selector("updates", "N", "Of each policy that learns; one takes about a second.", 200, int, 1),
    ),
    needs=lambda choice: (
        "mujoco", *(("onnxruntime",) * ("policy" in choice.controllers)),
        *(("torch",) * ("generalists" in choice.parts)),
        *(("torch", "stable_baselines3") * ("learners" in choice.parts)),
    ),
    measures="evaluating",
)  # fmt: skip

ROBORAN = Row(
    "roboran",
    "fulmar_benchmarks.roboran.campaign:Roboran",
    """Evaluate the shipped policies as thesis Table 4.7 does, and print both side by side.

    Success is evaluated on true states over the closing window, in 4,096 episodes of the core's batch and 256 in
    MuJoCo. DIR keeps results for the same code, configuration and controller, so an interrupted benchmark continues
    where it stopped. DIR/index.html is the report, DIR/roboran.json the figures.

    Try:

    fulmar benchmark roboran --robots turtlebot2 --tasks go_to_pose --controllers policy,classical
    """,
    (
        Selector("robots", "R,...", "Names with commas between, or all; the thesis' three by default.",
                 family="robot", known="configs/robots", usual="fulmar_benchmarks.roboran.targets:ROBOTS"),
        Selector("tasks", "T,...", "Names with commas between, or all; five by default.",
                 family="task", known="configs/tasks", usual="fulmar_benchmarks.roboran.targets:TASKS"),
        Selector("through", "W,...", "Out of batch, mujoco and ros, or all.", "batch,mujoco",
                 family="way", known="fulmar_benchmarks.roboran.targets:WAYS"),
        Selector("controllers", "K,...", "policy: the shipped bundles. classical: the laws of the families.", "policy",
                 family="kind of controller", known="fulmar_benchmarks.pairs:KINDS"),
        POLICIES,
        Selector("episodes", "N", "In every way; 4,096, 256 and 16 through ros by default.", None, int, 1),
        SCENARIO,
    ),
    needs=lambda choice: (
        *(("onnxruntime",) * ("policy" in choice.controllers)),
        *(("mujoco",) * bool({"mujoco", "ros"} & set(choice.through))),
    ),
    measures="evaluating",
)  # fmt: skip

ROWS = (
    EVERY,
    AVIST,
    CONSOLE,
    DESCENT,
    DRIFT,
    ENDURANCE,
    EVENTS,
    FALCON,
    FLIGHTS,
    GUARD,
    INERTIA,
    LATENCY,
    PACE,
    RANS3D,
    ROBORAN,
    THROUGHPUT,
    TRAINING,
)
