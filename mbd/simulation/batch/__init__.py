"""Thousands of runs from other starts and with other parameters, of which the end is kept."""
