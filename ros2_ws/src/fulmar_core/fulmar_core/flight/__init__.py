"""Aircraft: air, coefficients, ground effect, propulsion, turbulence, trim and modes."""
