"""The body: segments, what its joints resist, and what joins it to a prosthesis."""
