"""Parameters that make runs and gaits better."""
