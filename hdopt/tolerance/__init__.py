"""How a response spreads when its inputs spread as the tolerances say."""
