"""What the product computes, frozen to the bit, so that code can move without a change of behaviour."""
