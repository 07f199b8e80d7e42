"""What a gait laboratory asks for: recordings from files, motion from markers, moments from motion."""
