"""State estimation: from poses that come late and an inertial unit to position and velocity, without ROS."""
