"""Learning, judging and exporting policies.

Runs on a workstation, never on a robot, and knows no ROS.
"""
