"""The rclpy glue that every node shares.

Knows the core and ROS, but no simulator, policy or device.
"""
