"""How near `fulmar identify` comes to the truth, on simulated robots with other values."""
