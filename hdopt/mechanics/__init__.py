"""What follows from a design: contact, bending, lag, the path of a tooth, the life of the bearing."""
