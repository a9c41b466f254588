"""Configuration: strict YAML, paths, errors, plausible values, own classes, provenance, and files written whole."""
