"""How near `fulmar identify` comes to the truth, on simulated machines that nobody told it of."""
