"""The gate of the blind proof, frozen before its first full run.

A number here changes only with the reason in the commit.
"""

CONFIDENCE = 0.95

# One-sided upper bound of the rate at which recordings with nothing hidden are given physics or structure.
FALSE_ALARM_BOUND = 0.05
# Mean credit for the exact set of effects, cases of this severity (hidden rms over base rms) and above.
EXACT_SET = 0.90
EXACT_SET_FROM_SEVERITY = 0.5
# Share of physics outside the catalogue that is given a name of the catalogue.
UNKNOWN_NAMED = 0.10
# Median over cases of the held-out improvement, as a share of what an observer who knows the truth gains.
IMPROVEMENT = 0.80
# Mean distance between stated confidence and observed frequency over the bins of the reliability table.
CALIBRATION_ERROR = 0.05
RELIABILITY_BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)

# A proof with fewer cases than this proves nothing, however good its rates.
NOTHING_CASES = 300
UNKNOWN_CASES = 40
UNKNOWN_KINDS = 5
SEVERITIES = (0.1, 0.25, 0.5, 1.0)
