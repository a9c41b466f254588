"""Published results beside Fulmar's own, one folder a paper, and measurements of speed."""
