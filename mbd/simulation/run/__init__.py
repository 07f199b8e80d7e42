"""One run: the kernel called again and again, and what happens in Python between the calls."""
