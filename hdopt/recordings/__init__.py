"""Recordings of a drive: read, checked, cut into passes, turns and rows, and their orders."""
