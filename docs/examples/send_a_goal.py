"""A plain ROS node sends a goal to a robot that runs, and prints the way: `fulmar up --robot turtlebot2` first."""

import math

import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry

X, Y, TOLERANCE = 1.0, 0.5, 0.1  # [m]

rclpy.init()
node = rclpy.create_node("send_a_goal", namespace="turtlebot2")
goals = node.create_publisher(PoseStamped, "goal_pose", 10)
arrived = rclpy.Future()


def on_odometry(message):
    """Print the distance, and end where it is small."""
    place = message.pose.pose.position
    distance = math.hypot(X - place.x, Y - place.y)
    node.get_logger().info(f"{distance:.2f} m to go", throttle_duration_sec=1.0)
    if distance < TOLERANCE:
        arrived.set_result(distance)


while goals.get_subscription_count() < 2:  # the controller and the recorder
    rclpy.spin_once(node, timeout_sec=0.1)
goal = PoseStamped()
goal.header.frame_id = "odom"
goal.pose.position.x, goal.pose.position.y, goal.pose.orientation.w = X, Y, 1.0
goals.publish(goal)
node.create_subscription(Odometry, "odom", on_odometry, 10)
rclpy.spin_until_future_complete(node, arrived, timeout_sec=60.0)
print("arrived" if arrived.done() else "not arrived within 60 s")
rclpy.shutdown()
