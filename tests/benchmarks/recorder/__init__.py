"""What recording costs and what it loses: `fulmar benchmark recorder`."""
