"""The pure core of Fulmar in twelve rooms, lowest first; a room imports lower ones alone, see `make rooms`.

config, states, wires, robots, worlds, dynamics, tasks, simulation, estimators, controllers, safety, loop. It knows
neither ROS, nor a simulator, nor a learning library.
"""

from fulmar_core.config.moved_modules import keep_former_names

keep_former_names()
