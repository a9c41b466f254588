"""What the page shows, for other people's viewers: Foxglove, live and as a file, and Rerun as a file."""
