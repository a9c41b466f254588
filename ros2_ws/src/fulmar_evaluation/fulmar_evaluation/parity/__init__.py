"""One robot in every simulator: how far they part under the same commands, and how one controller does in each."""
