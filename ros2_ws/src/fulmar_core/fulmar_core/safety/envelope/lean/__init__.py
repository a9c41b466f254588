"""Guard of boats, wheels and wings: rollouts of a coarse model say whether a backup could still keep the robot."""
