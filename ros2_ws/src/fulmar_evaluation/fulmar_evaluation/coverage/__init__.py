"""How much of a thing's surface a camera has seen."""
