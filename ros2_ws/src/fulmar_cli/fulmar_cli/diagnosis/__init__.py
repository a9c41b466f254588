"""What `fulmar doctor` checks: each check is a function of its inputs that returns one finding."""
