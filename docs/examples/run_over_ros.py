"""The deployed nodes drive a simulated robot over ROS, as fast as they can; the run is recorded and evaluated."""

from fulmar_bringup.completion import completed
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_plan import RunPlan
from fulmar_evaluation.run_outcome import run_and_evaluate

asked = RunPlan(
    robot="turtlebot2",
    task="go_to_pose",
    controller="policy",
    backend="mujoco",
    control_hz=0.0,  # that of the policy
    goal=(1.0, 0.5, 1.57),  # x [m], y [m], heading [rad]
    duration_s=20.0,
    lockstep=True,  # the simulation waits for each command
    record="runs/from_python",
)
outcome = run_and_evaluate(checked(completed(asked)))
print(f"goal met: {outcome.summary['success']}; bag: {asked.record}")
