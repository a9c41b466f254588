"""Turn rates from the events of stars, beside thesis §6.4."""
