"""The pure core of Fulmar: robots, dynamics, tasks, controllers, safety, topics.

Knows neither ROS, nor a simulator, nor a learning library.
"""
