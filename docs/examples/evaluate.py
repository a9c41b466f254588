"""A classical law and a learned policy drive 64 air-bearing platforms to a pose: which one does better?"""

from fulmar_evaluation.evaluation import evaluate_trial
from fulmar_evaluation.trial_plan import plan_trial

pair = {"robot": "floating_platform", "task": "go_to_pose"}
for controller in ("lqr", "policy"):
    figures = evaluate_trial(plan_trial(**pair, controller=controller, through="batch", episodes=64))
    error_m = figures["final_position_error_m"]["median"]
    print(f"{controller}: {figures['success_rate']:.0%} reach the pose, {1000 * error_m:.0f} mm off")
