"""roboran."""
