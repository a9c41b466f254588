"""Rows of the catalogue: each benchmark with its words, its selectors, and what it needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from fulmar_benchmarks.catalogue import Row, Selector

if TYPE_CHECKING:
    from fulmar_benchmarks.shape import Choice

POLICY = Selector("policy", "DIR", "A policy bundle; the shipped one by default.", None, Path)
SCENARIO = Selector("scenario", "NAME", "Disturbances: a name from configs/scenarios.", "nominal")

DEPLOYED = ("rclpy", "mcap", "rosbags", "onnxruntime", "mujoco")  # modules of a whole system with a policy
NEEDED = {"policy": ("onnxruntime",)}  # modules of controllers

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

DESCENT = Row(
    "descent",
    "fulmar_benchmarks.descent.campaign:Descents",
    """Kill the controller of an aircraft in flight, and measure how the safe controller brings it down.

    Each flight holds its height for 4 to 6 s. Then its controller's process gets SIGKILL; until its hull touches the
    ground the plant's guard flies it, by the state that the plant measures. `lockstep`: plant and controller are the
    nodes of `fulmar run`, in lock step up to the kill; after it no command answers, and the plant steps through
    simulated time on its own. `realtime`: each node is a process, by the clock. `batch`: the same guard in the core's
    own dynamics, without ROS. A flight is good if its bank stays within 10 degrees until touch-down and it sinks by at
    most 1 m/s then. The exit code is 1 unless 60 of 64 are.

    Try:

    fulmar benchmark descent --flights 8 --through batch,lockstep
    """,
    (
        Selector("robot", "NAME", "An aircraft.", "airship_v7"),
        Selector("controller", "C", "What flies until it is killed: lqi, lqr, mppi, pid or policy.", "lqi"),
        POLICY,
        Selector("heights", "M,...", "Heights at which it is killed [m].", "1,5", numbers=(0.01, 100.0)),
        Selector("flights", "N", "Flights at each height.", 64, int, 1, names=("--flights", "--episodes")),
        Selector("through", "W,...", "Out of batch, lockstep and realtime, or all.", "all",
                 family="way", known="fulmar_benchmarks.descent.campaign:WAYS"),
        Selector("real_time", "N", "Flights in real time at each height.", 4, int, 1),
        SCENARIO,
    ),
    always_checked=True,
    measures="flights",
)  # fmt: skip

FLIGHTS = Row(
    "flights",
    "fulmar_benchmarks.falcon.live:LiveFlights",
    """Fly an aircraft through ROS nodes, in lock step and in real time, beside the same flights in the batch.

    The flights in lock step are those of the batch, by seed and number; each in real time has a twin in the batch that
    begins alike. A policy runs at the rate that it was trained at. Altitude RMSE is over all flights of a way that
    survive, other figures are their medians. The exit code is 1 unless the altitude's RMSE differs by 0.02 m at most
    and the 99th percentile of the control period's error stays below 3 ms in each real-time flight; nothing else should
    run meanwhile.

    Try:

    fulmar benchmark flights --controller lqi --episodes 8 --episode-s 20
    """,
    (
        Selector("robot", "NAME", "An aircraft.", "airship_v7"),
        Selector("task", "T", "fly_hold, or fly_a to fly_f.", "fly_hold"),
        Selector("controller", "C", "lqi, lqr, mppi, pid or policy.", "policy"),
        POLICY,
        Selector("episodes", "N", "Flights in lock step.", 64, int, 1),
        Selector("real_time", "N", "Flights in real time.", 4, int, 0),
        Selector("episode_s", "S", "Length of each [s].", 60.0, float, 5.0),
        SCENARIO,
        Selector("control_hz", "HZ", "Command rate; the robot's own by default.", None, float, 0.01),
    ),
    needs=lambda choice: ("rclpy", "mcap", "rosbags", "mujoco", *NEEDED.get(choice.controller, ())),
    always_checked=True,
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

LATENCY = Row(
    "latency",
    "fulmar_benchmarks.latency.cells:Latency",
    """Measure the latency from a state through the controller to the actuators, at several rates.

    Plant (MuJoCo), controller (the shipped policy of go_to_pose) and recorder are processes, as `fulmar run` has them.
    Latency goes from where the plant publishes its state to where it has taken the command that answers it. Each rate
    is measured on an idle computer, and with a busy process for each core; with rclpy's EventsExecutor,
    which Fulmar uses, and with its default one. Nothing else should run meanwhile. The exit code is 1 unless at 50 Hz
    the 99th percentile is below 3 ms when idle and no watchdog trips under load.

    Try:

    fulmar benchmark latency --rates 50 --executors events
    """,
    (
        Selector("rates", "HZ,...", "Commands a second, 5 to 500, with commas between.", "5,10,20,50,100,200",
                 numbers=(5.0, 500.0)),
        Selector("seconds", "S", "Seconds of each measurement.", 6.0, float, 1.0),
        Selector("executors", "E,...", "Executors of the nodes: events, default.", "events,default",
                 family="executor", known="fulmar_benchmarks.latency.cells:EXECUTORS", as_given=True),
    ),
    needs=lambda choice: DEPLOYED,
    shared=("ray", "resume", "check"),
    always_checked=True,
    timed=True,
)  # fmt: skip

ENDURANCE = Row(
    "endurance",
    "fulmar_benchmarks.latency.endurance:Endurance",
    """Run a system at 50 Hz of its own time for an hour: memory must not grow, and the bag must hold every command.

    The exit code is 1 if a node grows by 5 MB or more after a tenth of the time, or if the bag lacks a command that
    the plant has taken.

    Try:

    fulmar benchmark endurance --seconds 600 --rate 4
    """,
    (
        Selector("simulated_s", "S", "Length, in the robot's own time.", 3600.0, float, 10.0, names=("--seconds",)),
        Selector("rate", "F", "Simulated seconds per second of wall-clock time.", 1.0, float, 0.1, 10.0),
    ),
    needs=lambda choice: DEPLOYED,
    shared=("ray", "resume", "check"),
    always_checked=True,
    timed=True,
    dated=True,
    measures="running",
)  # fmt: skip

PACE = Row(
    "pace",
    "fulmar_benchmarks.pace.systems:Pace",
    """Measure steps a second in lock step, beside the same messages between two nodes that compute nothing.

    Each system runs as `fulmar run --lockstep` has it, with its recorder; its pace is read from its bag. Then two bare
    processes publish the messages of one of its steps and wait for each other: once as messages of rclpy, once as raw
    CDR. An estimator counts to the plant there. An LQR at 50 Hz in real time follows: latency from state to command,
    and errors of the period. Nothing else should run meanwhile.

    Try:

    fulmar benchmark pace --systems floating_platform_lqr,floating_platform_policy --json
    """,
    (
        Selector("systems", "S,...", "Robots with their controller and estimator; all by default.", "all",
                 family="system", known="fulmar_benchmarks.pace.systems:SYSTEMS"),
        Selector("steps", "N", "Steps of each system and of each bare pair.", 3000, int, 100),
        Selector("seconds", "S", "Length of the run in real time; 0: none [s].", 20.0, float, 0.0),
    ),
    needs=lambda choice: DEPLOYED,
    shared=("resume", "check"),
    timed=True,
)  # fmt: skip

THROUGHPUT = Row(
    "throughput",
    "fulmar_benchmarks.throughput_campaign:Throughput",
    """Measure environment steps a second of the core's batch, of MuJoCo's batch rollout and of JSBSim.

    A step of the batch has all that training needs: disturbances, odometry, observation, reward and new episodes.
    MuJoCo's is physics alone, with its own drag for water. Both are measured in turns in this run, on the same cores;
    the medians are printed. MuJoCo also rolls out ("otherwise") robots on water in the water of the plant, and robots
    in space by Euler's method; the plant has Runge-Kutta's of fourth order. Aircraft fly in JSBSim instead, one in a
    process for each core, in turbulence of its own where the scenario has any.
    Before that a step of each robot is compiled, which takes 10 to 30 s.

    Try:

    fulmar benchmark throughput --robots kingfisher,turtlebot2 --json
    """,
    (
        Selector("robots", "R,...", "Names with commas between; all by default.", family="robot",
                 known="configs/robots"),
        Selector("device", "cpu|cuda", "Where the batch is computed; cuda needs torch.", "cpu"),
        Selector("library", "compiled|numpy|torch",
                 "What computes the batch: on cpu a compiled kernel (which takes torch and g++) or else numpy, on cuda "
                 "torch."),
        Selector("worlds", "N", "Worlds of the batch.", 4096, int, 1),
        Selector("task", "T",
                 "Task of the batch; go_to_pose by default, in space go_to_pose_3d, of aircraft fly_hold."),
        replace(SCENARIO, default="randomised"),
        Selector("cores", "N", "Processes of the batch and of JSBSim, and threads of MuJoCo's.", 2, int, 1),
        Selector("seconds", "S", "Time of each of the measurements [s].", 1.0, float, 0.05),
    ),
    needs=lambda choice: _modules("throughput_campaign", choice),
    shared=("ray", "resume", "check"),
    timed=True,
)  # fmt: skip

TRAINING = Row(
    "training",
    "fulmar_benchmarks.training_campaign:Training",
    """Train with both, the same seeds side by side; print speed, and success over time.

    Success is the mean of the training scenario and the nominal one, on episodes that nobody learns from.
    """,
    (
        Selector("robot", "[ROBOT]", "A name from `fulmar list robots`.", "floating_platform", positional=True),
        Selector("task", "[TASK]", "A name from `fulmar list tasks`.", "go_to_pose", positional=True),
        Selector("seeds", "N", "Seeds 1 to N.", 5, int, 1),
        Selector("seconds", "S", "Wall-clock of each run.", 40.0, float, 1.0),
        Selector("check_every", "S", "Wall-clock between checks on held-out episodes.", 4.0, float, 0.5),
        Selector("at_once", "N", "Runs side by side.", 2, int, 1),
    ),
    needs=lambda choice: ("torch", "stable_baselines3"),
    shared=("ray", "resume", "check"),
    always_checked=True,
    timed=True,
    dated=True,
    measures="",
)  # fmt: skip


def _modules(campaign: str, choice: Choice) -> Sequence[str]:
    """What a benchmark needs that has to look at more than its choice."""
    needs: Callable[[Choice], Sequence[str]] = import_module(f"fulmar_benchmarks.{campaign}").needs
    return needs(choice)


EVERY = Row(
    "all",
    "fulmar_benchmarks.every.campaign:Every",
    """Run every benchmark at a chosen size, and write one page: published figure, ours, met or not, and the command.

    `smoke` takes minutes and shows that everything runs; `quick` takes an hour or two; `full` is what
    docs/benchmarks.md has. DIR keeps the document of each benchmark for the same command and code, so an interrupted
    run continues where it stopped. DIR/all.json has all figures, DIR/page.md is the page.

    Try:

    fulmar benchmark all --size smoke --only inertia,drift
    """,
    (
        Selector("size", "S", "smoke, quick or full.", "quick"),
        Selector("only", "NAME,...", "Names of benchmarks, or all.", "all",
                 family="benchmark", known="fulmar_benchmarks.every.sizes:NAMES"),
    ),
    measures="benchmarks",
)  # fmt: skip

ROWS = (
    EVERY,
    DESCENT,
    DRIFT,
    ENDURANCE,
    EVENTS,
    FALCON,
    FLIGHTS,
    INERTIA,
    LATENCY,
    PACE,
    RANS3D,
    ROBORAN,
    THROUGHPUT,
    TRAINING,
)
