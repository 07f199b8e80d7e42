"""What a run leaves behind: stored rows, named columns, values between the rows, files and tables."""
