"""State estimation without ROS: readings of sensors in, one estimate out; in a node, a batch, a re-run or offline."""
