"""Reports of recorded runs and of benchmarks: pages, plots and what writes them."""
