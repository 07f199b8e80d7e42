"""Questions asked of a run, a state or an integrator: energy, gait, mobility, small motions, numerical criteria."""
