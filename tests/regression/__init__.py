"""Golden answers: what every command said on the shipped studies, and the verdicts of short bench cases.

They hold the program's own output, so they prove nothing right; they show which answers a change moves. A change that
is meant to move some renews them and says so in its commit:

    python -m tests.regression.renew [commands] [cases]
"""
