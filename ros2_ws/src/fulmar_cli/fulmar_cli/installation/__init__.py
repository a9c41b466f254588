"""How this Fulmar is installed, which extras it has, and the service that it installs."""
