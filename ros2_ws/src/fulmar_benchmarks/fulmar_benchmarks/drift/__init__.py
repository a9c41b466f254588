"""Our controllers beside DRIFT's own under disturbances: thesis Tables 3.5 and 3.6, evaluated, printed, drawn."""
