"""Drives with effects that repeat every input turn, one drive a lane: one turn is scanned, few cells are looked at."""
