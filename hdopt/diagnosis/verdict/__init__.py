"""What the evidence allows to be said."""
