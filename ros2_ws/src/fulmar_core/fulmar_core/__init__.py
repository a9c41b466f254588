"""The pure heart of Fulmar: robots, dynamics, tasks, controllers, safety, wires.

Knows neither ROS, nor a simulator, nor a learning library.
"""
