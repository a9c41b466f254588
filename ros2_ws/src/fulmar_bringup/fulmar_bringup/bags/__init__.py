"""Bags that answer questions: what is in them, what a controller would say to them, what differs. Needs no ROS."""
