"""What viewers draw of a robot and its goal: shapes, without ROS. `fulmar_ros.markers_node` publishes them."""
