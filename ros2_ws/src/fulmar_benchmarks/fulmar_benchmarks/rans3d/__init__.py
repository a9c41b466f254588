"""Our controllers at the 3-D tasks of RANS: bodies in space, evaluated in MuJoCo."""
