"""How long a state's journey through the controller and back takes, and what it costs."""

EXECUTORS = ("events", "default")  # of the nodes: the one that Fulmar uses, and that of rclpy
