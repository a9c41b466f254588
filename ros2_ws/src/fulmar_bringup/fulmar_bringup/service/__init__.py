"""A system as a service of systemd, which begins at boot; and the rules of udev for its devices."""
