"""How long a state's journey through the controller and back takes, and what it costs."""
