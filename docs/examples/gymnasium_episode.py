"""An episode of a task as a Gymnasium environment, for any library that learns; needs `make with EXTRA=gym`."""

import gymnasium

import training.environments  # noqa: F401  registers every task as fulmar/<task>-v0

env = gymnasium.make("fulmar/go_to_pose-v0", robot="turtlebot2", seed=1)
observation, _ = env.reset()
total, ended = 0.0, False
while not ended:
    observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
    total, ended = total + reward, terminated or truncated

print(
    f"{env.spec.id}: {len(observation)} observations, {env.action_space.shape[0]} actions; return {total:.1f}"
)
