"""Models from files of other programs."""
