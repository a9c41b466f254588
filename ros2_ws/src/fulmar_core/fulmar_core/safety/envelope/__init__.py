"""Guard of a body that floats: it is stopped in time to stay within its bounds, whatever its controller wants."""
