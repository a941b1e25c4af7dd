"""Drives with effects that differ from turn to turn: cells of one turn are bounded, and few are taken turn by turn."""
