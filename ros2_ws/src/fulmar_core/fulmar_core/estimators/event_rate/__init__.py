"""Turn rate of a body from the events of a camera that looks at the stars."""
