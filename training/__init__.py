"""Training, evaluation and export of policies.

Runs on a workstation, never on a robot, and knows no ROS.
"""
