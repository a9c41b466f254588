"""Robots of a ROS domain as a source of the page. `ros_side` and `orders` import rclpy, once the page is served."""
