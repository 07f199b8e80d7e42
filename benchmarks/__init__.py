"""What `mbd` costs, measured: see README.md here, and run ``python -m benchmarks``."""
