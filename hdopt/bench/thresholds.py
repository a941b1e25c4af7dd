"""The gate of the blind proof. A number here changes only with the reason in the commit."""

CONFIDENCE = 0.95

# One-sided upper bound of the rate at which recordings with nothing hidden are given physics or structure.
FALSE_ALARM_BOUND = 0.01
# Share of right answers by the number of hidden effects, from this severity (hidden rms over base rms) on.
EXACT_SET = {1: 0.95, 2: 0.90, 3: 0.80}
EXACT_SET_FROM_SEVERITY = 0.25
# Share of physics outside the catalogue that is given a name, and that is recognised.
UNKNOWN_NAMED, UNKNOWN_RECOGNISED = 0.03, 0.95
# Median over cases of the improvement of the nested held-out error, as a share of what an observer gains who
# knows the truth.
IMPROVEMENT = 0.95
# Share of 95 % intervals that hold the truth.
COVERAGE = (0.93, 0.97)
# Mean distance between stated confidence and observed frequency over the bins of the reliability table.
CALIBRATION_ERROR = 0.03
RELIABILITY_BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
# A confidence of 0 or 1 that is wrong would have a log score of minus infinity.
LEAST_CONFIDENCE = 1e-3

# A proof with fewer cases than this proves nothing, however good its rates.
CASES, DRIVES = 1000, 4
LEAST = {"nothing hidden": 300, "pair": 100, "triple": 60, "unknown": 150}
