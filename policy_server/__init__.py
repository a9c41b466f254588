"""Policies and classical controllers, served to a robot.

Only the modules that end in _node know ROS; none of them knows torch.
"""
