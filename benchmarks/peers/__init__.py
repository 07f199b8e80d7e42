"""The same scenes in `mbd` and in other multibody systems: time to an error, measured in one run."""
