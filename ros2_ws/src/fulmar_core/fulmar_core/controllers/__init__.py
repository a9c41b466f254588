"""Classical controllers, and the interface that every controller has."""
