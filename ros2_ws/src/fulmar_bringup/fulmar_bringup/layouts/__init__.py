"""Layouts of viewers for one robot: Foxglove and RViz, made of its file and the table of topics."""
