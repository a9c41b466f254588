"""One module for each command of `fulmar`; heavy imports happen inside them."""
