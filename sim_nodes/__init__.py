"""Simulated robots behind the backend seam.

Only the modules that end in _node know ROS.
"""
