"""Operating envelopes: the conditions under which a controller is certified to succeed."""
