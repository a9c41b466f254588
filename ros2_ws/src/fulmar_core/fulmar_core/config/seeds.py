"""Seeds that are kept for evaluation; a module of its own, so that the command line needs no NumPy to name them."""

EVALUATION_SEED = 2026  # of the episodes on which finished controllers are evaluated
HELD_OUT_SEED = 1_000_003  # of the episodes on which learners are checked
EVALUATION_SEEDS = (EVALUATION_SEED, HELD_OUT_SEED)  # no training seeds: no run may learn from these episodes
