"""Parameters of a model from measured motion."""
