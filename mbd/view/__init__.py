"""Pictures of a run: plots on paper, pages in a browser."""
