"""What a controller can subtract: the error as a function of input angle, output angle and direction, and its files."""
