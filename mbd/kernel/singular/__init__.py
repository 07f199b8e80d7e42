"""Singular configurations, where the constraint Jacobian loses rank for an instant."""
