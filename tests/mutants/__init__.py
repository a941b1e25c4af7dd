"""Mutation testing: would the tests notice a fault? `make mutants`, or `python -m tests.mutants ROOM --sample 40`.

Faults are those of cosmic-ray's own operators, put in one at a time, in an order drawn from a fixed seed. A mutant is
killed by the validation and unit tests of its room alone; golden answers do not count. Time-outs are counted apart.
"""
