"""What a found explanation must stand: rivals, wander, steps, and what remains."""
