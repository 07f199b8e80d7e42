"""A consistent start: named values held, the rest completed, every conflict named."""
