"""Estimators without ROS: readings in, an estimate out; in a node, a batch, a re-run or offline."""
