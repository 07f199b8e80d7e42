"""Questions asked of a run: energy, gait."""
