"""DreamerV3 by sheeprl: it learns in an environment of its own (`make dreamer`), its policies run like all others."""
