"""Motion of bodies under forces: pure functions, batch-first, any array library."""
