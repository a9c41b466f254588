"""An aircraft's coefficients from the geometry of its surfaces, by a vortex lattice."""
