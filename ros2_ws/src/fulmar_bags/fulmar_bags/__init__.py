"""Bags as files: write, recover, read, compare, export.

Knows the core and the formats of bags, and never rclpy.
"""
