"""The benchmark after RL-AVIST: a cubesat that goes, follows and inspects."""
