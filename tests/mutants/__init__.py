"""Guards of the product, each with the test that fails without it."""
