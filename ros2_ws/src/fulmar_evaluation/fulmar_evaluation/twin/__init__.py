"""From bags of a robot to a policy for it as it is: identify, evaluate, train again, evaluate, compare."""
