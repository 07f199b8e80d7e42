"""What a run says of itself: notes, causes of failures, and what to try."""
