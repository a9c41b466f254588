"""Aircraft whose controller is killed in flight: how the safe controller brings them down."""
