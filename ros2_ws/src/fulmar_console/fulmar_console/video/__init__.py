"""Films of recorded runs: the robots as they look, drawn by MuJoCo, with plumes, goals, trails and figures."""
