"""Small dense and ordered linear equations, rank, and solutions of least norm."""
