"""`fulmar benchmark all`: every benchmark at one of three sizes, and one page."""
