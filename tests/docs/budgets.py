"""What the test of the documented command lines changes in them, and why: placeholders, budgets, companions.

Every entry is used: tests/docs/test_command_lines.py fails for one that no line needs.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from fulmar_benchmarks.every.sizes import NAMES, options
from tests.docs.command_lines import ROOT

SMOKE = {name: " ".join(options(name, "smoke")) for name in NAMES}

CTRL_C = "timeout --preserve-status -s INT 8"  # of goals that go round for ever
# Placeholders and budgets of single lines: what is run in the place of what stands there.
INSTEAD = {
    "fulmar bag info BAG": "fulmar bag info runs/first",
    "fulmar bag rerun BAG --controller C": "fulmar bag rerun runs/first --controller lqr",
    "fulmar bag diff BAG OTHER": "fulmar bag diff runs/first runs/first",
    "fulmar bag play BAG": "fulmar bag play runs/first --rate 20",
    "fulmar bag play BAG --to xplane": "fulmar bag play runs/flight --to xplane --rate 20",
    "fulmar bag plot BAG": "fulmar bag plot runs/first",
    "fulmar bag export BAG --to FORMAT": "fulmar bag export runs/first --to csv",
    "fulmar bag reference": f"cd {ROOT} && fulmar bag reference",
    "fulmar bag recover BAG": "fulmar bag recover runs/first",
    "fulmar bag play runs/flight --to xplane": "fulmar bag play runs/flight --to xplane --rate 20",
    "fulmar report runs/RUN": "fulmar report runs/first",
    "fulmar bag info runs/RUN": "fulmar bag info runs/first",
    "fulmar bag plot runs/RUN": "fulmar bag plot runs/first",
    "fulmar bag export runs/RUN --to csv --out runs/csv": "fulmar bag export runs/first --to csv --out runs/csv",
    "fulmar bag rerun BAG --controller classical --from odometry": (
        "fulmar bag rerun runs/mine --controller classical --from odometry"
    ),
    "fulmar bag rerun BAG --controller my_control:Steer": "fulmar bag rerun runs/mine --controller my_control:Steer",
    "fulmar evaluate ROBOT TASK --controller C --through batch|mujoco|ros --episodes N": (
        "fulmar evaluate turtlebot2 go_to_pose --controller classical --through batch --episodes 4"
    ),
    "fulmar identify runs/...": "fulmar identify runs/*excite*",
    "fulmar new airframe GEOMETRY --out FILE": (
        f"fulmar new airframe {ROOT / 'tests/peers/airship_v7_geometry.yaml'} --out wing.yaml"
    ),
    "fulmar new robot NAME --like ROBOT --urdf FILE": "fulmar new robot husky --like turtlebot2 --urdf husky.urdf",
    "fulmar new task NAME": "fulmar new task dock_gate",
    "fulmar export RUN --out DIR": "fulmar export runs/train/*airship_v7* --out runs/bundles/exported",
    "fulmar export runs/train/... --out bundles/dock": "fulmar export runs/train/*dock* --out bundles/dock",
    "fulmar train --resume RUN --time-limit 3600": (
        "fulmar train --resume runs/train/*airship_v7* --time-limit 3 --episodes 4"
    ),
    "fulmar bundle verify runs/bundles/mine --trusted lab.pem": (
        "fulmar bundle keys private.pem lab.pem && fulmar bundle sign runs/bundles/mine --key private.pem && "
        "fulmar bundle verify runs/bundles/mine --trusted lab.pem"
    ),
    "fulmar benchmark all --size smoke": "fulmar benchmark all --size smoke --only avist",
    "fulmar benchmark roboran": (
        "fulmar benchmark roboran --robots turtlebot2 --tasks go_to_position --through batch --episodes 64 --no-report"
    ),
    "fulmar benchmark falcon": "fulmar benchmark falcon --tasks hold --controllers lqi --scenarios calm --episodes 2",
    "fulmar benchmark falcon --tasks a,b,c,d,e,f --controllers lqi,mppi,pid --scenarios exact --seed 3": (
        "fulmar benchmark falcon --tasks a --controllers lqi,mppi,pid --scenarios exact --seed 3 --episodes 1"
    ),
    "fulmar simulation step floating_platform --steps 10": (
        "fulmar simulation pause floating_platform && fulmar simulation step floating_platform --steps 10"
    ),
    "fulmar commission HARDWARE --yes": "fulmar commission turtlebot2 --emulate --yes",
    "fulmar policies": "fulmar policies --out shipped",
    "fulmar service install mujoco_classical --backend hardware": (
        "fulmar service install mujoco_classical --backend hardware --robot turtlebot2 --root image --user nobody"
    ),
    "fulmar service install mujoco_classical --backend hardware --robot turtlebot2": (
        "fulmar service install mujoco_classical --backend hardware --robot turtlebot2 --root image --user nobody"
    ),
    "fulmar service remove mujoco_classical": "fulmar service remove mujoco_classical --root image",
    "fulmar service status": "fulmar service status --root image",
    "fulmar faults --robot turtlebot2": "fulmar faults --robot turtlebot2 --only odometry_silent",
    "fulmar faults --robot airship_v7": "fulmar faults --robot airship_v7 --only odometry_not_a_number",
    "fulmar faults --system fleet --robot beta": "fulmar faults --system fleet --robot beta --only fleet_estop",
    "fulmar evaluate --system swap_places --through ros --episodes 20 --seed 0": (
        "fulmar evaluate --system swap_places --through ros --episodes 1 --seed 0"
    ),
    "fulmar goals circle --robot turtlebot2": f"{CTRL_C} fulmar goals circle --robot turtlebot2",
    "fulmar goals my_eight.yaml --robot turtlebot2": (
        f"{CTRL_C} fulmar goals my_eight.yaml --robot turtlebot2"
    ),
    "fulmar goals circle --robot turtlebot2 --name alpha": (
        f"{CTRL_C} fulmar goals circle --robot turtlebot2 --name alpha"
    ),
    "fulmar goals fleet_alpha --robot floating_platform --name alpha --as-path": (
        f"{CTRL_C} fulmar goals fleet_alpha --robot floating_platform --name alpha --as-path"
    ),
    "fulmar goals upright_circle --robot spacecraft_16": (
        f"{CTRL_C} fulmar goals upright_circle --robot spacecraft_16"
    ),
}
# Parts of lines, in this order: pattern and what is put there. Real time is cut to seconds, learning to a few updates.
PARTS = [
    (r"^(fulmar (?:console|view) .*)$|^(fulmar console)$", r"\1\2 --port 0"),
    (r" --console$", " --console --console-port 0"),
    (r" --time-limit \d+", " --time-limit 3"),
    (r" --updates \d+", " --updates 1"),
    (r"( --video \S+)$", r"\1 --size 160x90 --span 0,2"),
    (r"( --video .*--size) \d+x\d+", r"\1 160x90"),
    (r"( --video .*--span) (\d+),\d+", r"\1 \2,\g<2>.5"),
    (r" \[--parts \S+\] \[--json\]$", ""),
    (r"( --accept --bundle runs/bundles)/mine", r"\1/accepted"),  # new or empty; `mine` is given
    (r"^(fulmar twin .*)$", r"\1 --episodes 4 --updates 1"),
    (r"^(fulmar parity (?!.*--duration).*)$", r"\1 --runs 1 --duration 10"),
    (r"^(fulmar parity (?!.*--episodes).*)$", r"\1 --episodes 1"),
    (r" --platforms \d+", " --platforms 1"),
    (r" --seeds 5", " --seeds 2"),
    (r" --episodes \d{2,}", " --episodes 4"),
    (
        r"^(fulmar certify .*--again.*)$",
        r"\1 --episodes 2000 --mujoco 8",
    ),  # a set of 400 just holds with as many
    (r"^(fulmar certify (?!--replay|.*--episodes).*)$", r"\1 --episodes 400 --mujoco 8"),
    (r"^(fulmar train (?!.*--(?:time-limit|updates)).*)$", r"\1 --updates 1"),
    (r"^(fulmar (?:train|evaluate) (?!.*--episodes).*)$", r"\1 --episodes 4"),
    (r"^(fulmar run cubesat_wheels (?!.*--duration).*)$", r"\1 --duration 75"),
    (r"^(fulmar run cubesat_wheels --scenario gyro_dies --duration) 120", r"\1 75"),  # it dies after 60 s
    (  # thousands of steps; they begin in trim
        r"^(.*fulmar run (?:airship_v7|navion|cessna_182) (?!.*--(?:duration|scenario))(?=.*--lockstep).*)$",
        r"\1 --duration 15",
    ),
    (r"^(fulmar run (?!.*--(?:lockstep|duration)).*)$", r"\1 --duration 5"),
    (r"^(fulmar run (?!.*--lockstep).* --duration) 120", r"\1 15"),
    (r"^(fulmar run (?!.*--lockstep).* --duration) 30", r"\1 5"),
]
BENCHMARK = re.compile(r"^fulmar benchmark (\S+)(.*)$")


def shortened(text: str, parts: Sequence[tuple[str, str]] = PARTS) -> str:
    """The line that is run for a line of the docs: itself, or its cheaper twin."""
    if text in INSTEAD:
        return INSTEAD[text]
    for pattern, part in parts:
        text = re.sub(pattern, part, text)
    if (found := BENCHMARK.match(text)) and found[1] in SMOKE:
        text += _missing(found[2], SMOKE[found[1]])
    return text


def _missing(shown: str, smoke: str) -> str:
    """Options of a benchmark's smallest size that its line does not give itself."""
    given = set(re.findall(r"--[a-z-]+", shown))
    pairs = re.findall(r"(--[a-z-]+)((?: (?!--)\S+)*)", smoke)
    return "".join(f" {name}{value}" for name, value in pairs if name not in given)
