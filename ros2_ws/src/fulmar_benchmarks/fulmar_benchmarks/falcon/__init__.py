"""FALCON-S: a ground-effect craft along the references of the thesis, by task, controller and scenario."""
