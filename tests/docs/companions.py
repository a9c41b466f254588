"""What the documented command lines find there: files, robots that run beside them; and those that no test can run."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from rosbags.rosbag2.enums import StoragePlugin

from tests.docs.command_lines import ROOT, Line
from tests.foreign_bag import write_foreign
from tests.own_files import blocks, write_sentry
from tests.robot_files import FOUR, TURTLE

PLATFORM, TURTLEBOT = "fulmar up mujoco_policy", "fulmar up --robot turtlebot2"
SPACECRAFT, SATELLITE = "fulmar up mujoco_spacecraft", "fulmar up mujoco_satellite"
ALPHA, BETA = "fulmar up mujoco_policy --name alpha", "fulmar up mujoco_lqr --name beta"
PLANT = "fulmar up mujoco_lqr --estop --only plant"
GUARDED = "fulmar up mujoco_policy --estop"
VELOCITIES = "fulmar up --robot turtlebot2 --task track_velocities"
EXTERNAL = (
    "fulmar run turtlebot2 --task go_to_position --controller external --adapter turtlebot2_kobuki_node "
    "--topic /velocity_smoother/input"
)
XPLANE, BOARD = "python xplane.py", "python board.py"
# What must run beside a line: all else is ended before. Lines without an entry find what their block has started.
BESIDE = {
    "fulmar goals --robot floating_platform --pose 1,-0.5,90": (PLATFORM,),
    "fulmar goals lab_pose --robot floating_platform": (PLATFORM,),
    "fulmar simulation pause floating_platform": (PLATFORM,),
    "fulmar simulation step floating_platform --steps 10": (PLATFORM,),
    "fulmar status": (PLATFORM,),
    "fulmar status turtlebot2 --wait active": (TURTLEBOT,),
    "fulmar goals --robot turtlebot2 --pose 1,0,0": (TURTLEBOT,),
    "fulmar goals circle --robot turtlebot2": (VELOCITIES,),
    "fulmar goals my_eight.yaml --robot turtlebot2": (VELOCITIES,),
    "fulmar goals circle --robot turtlebot2 --name alpha": (f"{VELOCITIES} --name alpha",),
    "fulmar goals --robot spacecraft_16 --pose 1,0,-0.5,0,30,90": (SPACECRAFT,),
    "fulmar goals --robot spacecraft_16 --position 1,0,-0.5": (f"{SPACECRAFT} --task go_to_position_3d",),
    "fulmar goals upright_circle --robot spacecraft_16": (SPACECRAFT,),
    "fulmar goals --robot cubesat_wheels --pose 0,0,90": (SATELLITE,),
    "fulmar swap floating_platform lqr": (PLATFORM,),
    "fulmar estop": (GUARDED,),
    "fulmar estop --reset": (GUARDED,),
    "fulmar estop turtlebot2": (f"{TURTLEBOT} --estop",),
    "fulmar status turtlebot2 --wait active --timeout 30 && python my_goals.py": (TURTLEBOT,),
    "fulmar teleop turtlebot2": (TURTLEBOT,),
    "fulmar up mujoco_lqr --estop --only controller": (PLANT,),
    "fulmar status floating_platform --node plant": (PLANT, f"{PLANT[:-5]}controller"),
    BETA: (ALPHA,),
    "fulmar teleop floating_platform --name beta": (ALPHA, BETA),
    "fulmar run turtlebot2 --task go_to_position --controller external --lockstep": ("python steer.py",),
    EXTERNAL: ("python velocities.py",),
    "fulmar bag play BAG --to xplane": (XPLANE,),
    "fulmar bag play runs/flight --to xplane": (XPLANE,),
    "fulmar doctor --for hardware relay_board.yaml": (BOARD,),
    "fulmar commission relay_board.yaml": (BOARD,),
    "fulmar run floating_platform --backend hardware --hardware relay_board.yaml --goal 0.5,0": (BOARD,),
}


BAGS, POLICIES = ROOT / "tests/replay/bags", ROOT / "policy_server/policies"
# What a reader has from earlier pages, unless the page makes it itself.
GIVEN = {
    "runs/first": BAGS / "floating_platform_go_to_pose_lqr",
    "runs/second": BAGS / "floating_platform_go_to_pose_policy",
    "runs/demo_20260101_120000/policy": BAGS / "floating_platform_go_to_pose_policy",
    "runs/flight": BAGS / "airship_v7_fly_hold_lqi",
    "runs/mine": BAGS / "turtlebot2_go_to_position_policy",
    "runs/bundles/mine": POLICIES / "floating_platform_go_to_pose",
    "runs/bundles/first": POLICIES / "floating_platform_go_to_pose",
    "shipped": POLICIES,
    "configs": ROOT / "configs",
}
PLANE = """import threading
from tests.hardware_drivers.xplane_bench import Peer
with Peer(port=49009):
    print("ready", flush=True)
    threading.Event().wait()
"""
VELOCITIES_OF_ANOTHER_STACK = """import rclpy
from geometry_msgs.msg import Twist
rclpy.init()
node = rclpy.create_node("other_stack")
commands = node.create_publisher(Twist, "/velocity_smoother/input", 10)
node.create_timer(0.1, lambda: commands.publish(Twist()))
print("ready", flush=True)
rclpy.spin(node)
"""
AGENT = "models: {policy: {network: [{name: net, layers: [16], activations: elu}], output: tanh(ACTIONS)}}\n"
# Lines that run only where something is that not every machine has, and what.
NEEDS = {
    "fulmar new airframe GEOMETRY --out FILE": ROOT / ".venv-peers/bin/python",
    "fulmar run spacecraft_16 --backend basilisk --lockstep --seed 3": ROOT / ".venv-peers/bin/python",
    "fulmar run cubesat_wheels --backend basilisk --goal 0,0,90 --lockstep --seed 3": ROOT
    / ".venv-peers/bin/python",
    "fulmar evaluate spacecraft_16 go_to_pose_3d --through basilisk --episodes 16": ROOT
    / ".venv-peers/bin/python",
    "fulmar train kingfisher go_to_pose --settings dreamer": ROOT / ".venv-dreamer/bin/python",
    "fulmar train cubesat_8 track_velocities_3d --settings dreamer --updates 4000": ROOT
    / ".venv-dreamer/bin/python",
}
# Exit codes that a page announces.
CODES: dict[str, tuple[int, ...]] = {
    # Another policy answers otherwise.
    "fulmar bag rerun runs/demo_20260101_120000/policy --policy runs/bundles/mine": (1,),
    # There is nothing to compare with.
    "fulmar bag rerun theirs --controller policy --robot turtlebot2 --task go_to_position --goal 0,0,0 "
    "--out answers.csv": (1,),
    # It stops before the wall.
    "fulmar run sentry --task go_to_position --controller my_control:KeepOff --lockstep --record bag": (1,),
    # The board measures no position.
    "fulmar run floating_platform --backend hardware --hardware relay_board.yaml --goal 0.5,0": (1,),
    # With a dead valve it has no certified set.
    "fulmar certify policy --robot floating_platform --task go_to_pose --dead 1": (1,),
    # Gusts carry it further than it may go.
    "fulmar run airship_v7 --task fly_hold --controller lqi --scenario light_turbulence --lockstep --seed 3": (
        1,
    ),
    # The recorded commands are those of another controller.
    "fulmar bag rerun BAG --controller my_control:Steer": (1,),
    "fulmar bag rerun BAG --controller classical --from odometry": (1,),
    # The clock of a computer that tests may follow no other one, as that of a robot has to.
    "fulmar doctor --for hardware relay_board.yaml": (0, 1),
    # Times of a loop, for two seconds, beside other tests.
    "fulmar benchmark latency": (0, 1),
    "fulmar benchmark pace": (0, 1),
}
# Whole runs of policies that have learned for three seconds: they may miss their goals.
LEARNED_BRIEFLY = {
    "fulmar run mybot --task go_to_position --policy runs/bundles/mybot --lockstep",
    "fulmar run floating_platform --policy runs/bundles/first --lockstep --seed 7",
    "fulmar run hexbot --task go_to_pose --policy runs/bundles/hexbot --lockstep --seed 3",
}
CLUSTER = "needs a Ray cluster; tests/training has one of two nodes"
# Lines that no test of one machine can run, and why.
EXCLUDED = {
    "fulmar benchmark drift --through batch --ray HOST:6379": CLUSTER,
    "fulmar train turtlebot2 go_to_pose --seeds 5 --ray HOST:6379": CLUSTER,
    "fulmar bag play runs/flight --to xplane --host 192.168.1.20 --port 49009": "needs another computer",
}


def prepare(page: str, lines: list[Line], folder: Path) -> None:
    """Put what a page takes for granted into the folder of its lines."""
    text = "\n".join(line.text for line in lines)
    for place, source in GIVEN.items():
        if not re.search(rf"--(?:out|record) {place}(?:\s|$)", text):
            shutil.copytree(source, folder / place)
    if page == "own-sensor":
        write_sentry(folder)
    if page == "own-driver":
        _relay_board(folder)
    if page in ("new_robot", "commands"):
        (folder / "husky.urdf").write_text(TURTLE, encoding="utf-8")
    if page == "new_robot":
        (folder / "four.xml").write_text(FOUR, encoding="utf-8")
    if page == "bags":
        write_foreign(folder / "theirs", StoragePlugin.MCAP, commands=True, velocity="/base/velocity")
    if "best_agent.pt" in text:
        _agent(folder / ("runs/skrl/turtlebot2" if page == "roboran" else "."), in_run=page == "roboran")
    if "night.aedat4" in text:
        _recordings(folder)
    if page == "flight":
        (folder / "own/tasks").mkdir(parents=True)
        task = (ROOT / "configs/tasks/fly_hold.yaml").read_text(encoding="utf-8")
        task = re.sub(r"height: \[.*?\]", "height: [20.0, 20.0]", task).replace(
            "name: fly_hold", "name: fly_high"
        )
        (folder / "own/tasks/fly_high.yaml").write_text(task, encoding="utf-8")
    if page in ("bags", "flight"):
        (folder / "xplane.py").write_text(PLANE, encoding="utf-8")
    if page == "goals":
        (folder / "my_eight.yaml").write_text(blocks("goals.md", "yaml")[0], encoding="utf-8")
        (folder / "my_goals.py").write_text("print('a script of goals')\n", encoding="utf-8")
    if page == "external-controller":
        (folder / "velocities.py").write_text(VELOCITIES_OF_ANOTHER_STACK, encoding="utf-8")
    if page == "looking":
        _hexbot(folder)


def _hexbot(folder: Path) -> None:
    page = (ROOT / "docs/first_hour.md").read_text(encoding="utf-8")
    found = re.search(r"^cat > (mine/robots/\S+) <<'EOF'\n(.*?)^EOF$", page, re.MULTILINE | re.DOTALL)
    assert found
    (folder / found[1]).parent.mkdir(parents=True)
    (folder / found[1]).write_text(found[2], encoding="utf-8")


def _relay_board(folder: Path) -> None:
    driver, board = blocks("own-driver.md", "python")[:2]
    (folder / "relay_board.py").write_text(driver, encoding="utf-8")
    (folder / "board.py").write_text(board, encoding="utf-8")
    (folder / "relay_board.yaml").write_text(blocks("own-driver.md", "yaml")[0], encoding="utf-8")


def _agent(folder: Path, *, in_run: bool) -> None:
    """A checkpoint of skrl, alone or in the run folder that says how its network is made."""
    from tests.training import foreign

    path = folder / "checkpoints/best_agent.pt" if in_run else folder / "best_agent.pt"
    path.parent.mkdir(parents=True, exist_ok=True)
    if in_run:
        (folder / "params").mkdir()
        (folder / "params/agent.yaml").write_text(AGENT, encoding="utf-8")
    foreign.save_skrl(path, foreign.network(8, 2, tanh_output=True))


def _recordings(folder: Path) -> None:
    from fulmar_bags.event_files import open_event_file
    from tests.fulmar_cli.test_rates import whole, write_dsec

    source = ROOT / "tests/fulmar_bags/event_files/stars.aedat4"
    shutil.copy(source, folder / "night.aedat4")
    for name in ("left.h5", "right.h5"):
        write_dsec(folder / name, whole(open_event_file(source)))
