"""Integration schemes as compiled functions of the kernel."""
