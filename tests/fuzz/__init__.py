"""Inputs made at random, and the one rule for all of them: 0, 1 or 2, one short message, valid JSON, no traceback."""
