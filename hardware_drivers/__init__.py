"""Real devices behind the backend seam: one driver a device, one file a protocol.

Only the modules that end in _node know ROS.
"""
