"""Stars, cameras that see them, and events of their motion."""
