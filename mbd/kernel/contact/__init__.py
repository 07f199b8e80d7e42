"""Who pushes, sticks and slides: active sets, impacts, cones of friction, steps that locate no instants."""
