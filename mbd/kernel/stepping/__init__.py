"""Steps: where they end, what is tried, how a candidate is judged, taken over, and started again."""
