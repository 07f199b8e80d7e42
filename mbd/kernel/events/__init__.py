"""What happens within a step: guards that cross zero, the instants at which they do, and the switches that follow."""
