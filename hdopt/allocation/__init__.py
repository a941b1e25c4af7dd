"""Least-cost tolerances: what they cost, the rules they keep, and the solvers."""
