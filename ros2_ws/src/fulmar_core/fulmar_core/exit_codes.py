"""How every process of Fulmar says how it went."""

DONE, FAILED, BAD_USAGE = 0, 1, 2
