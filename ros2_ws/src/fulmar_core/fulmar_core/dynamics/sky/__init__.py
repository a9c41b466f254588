"""Events that moving stars cause in a camera."""
