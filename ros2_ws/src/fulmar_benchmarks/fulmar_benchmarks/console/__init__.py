"""What the operator's page costs, how soon it is there, and how fast and surely its e-stop works."""
