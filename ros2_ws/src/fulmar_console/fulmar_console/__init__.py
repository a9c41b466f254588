"""The operator's page: robots of a ROS domain, or bags, in a browser.

One process serves the page over HTTP and one websocket. What it shows and does goes through topics and services that
any other client has too; the robots know nothing of it.
"""

ADDRESS, PORT = "127.0.0.1", 8090  # that it listens on where nothing else is asked for
