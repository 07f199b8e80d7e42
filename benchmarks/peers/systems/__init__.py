"""One module per system; each says what it needs installed and offers `attempts(scene)`."""
