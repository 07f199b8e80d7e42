"""A tolerance on the whole run: trial runs until the error of one agrees with it."""
