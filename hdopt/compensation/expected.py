"""Peak-to-peak to expect of a fresh recording, from what a compensation left of one, and how far it may be off."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array, Index

WINDOW = 9
"""Rows over which a running mean is what comes again; the rest is noise."""
TAILS = 0.12
"""Excess of the noise's fourth moment (of a normal one 0, +-0.05 by chance in 10 000 rows) up to which it is drawn."""
DRAWS, RESAMPLES = 60, 400
DRAWN = 1.25
"""How much further a fresh recording may be off than the draws among themselves: what is drawn is estimated too."""
SEEN = 2.3
"""The same over resampled turns: their largest is the largest itself in 63 % of the draws, which leaves 0.61 of its
standard deviation (exponential tails), and a fresh recording has its own (the root of 2)."""
NORMAL = 1.96


def peak_to_peak_again(left: Array, block: Index, rng: np.random.Generator) -> tuple[float, float]:
    """Peak-to-peak (arcmin) to expect of a recording like the one that this was `left` of (n,), and its standard
    deviation; `block` (n,) are its whole input turns, `rng` draws.

    The extremes of one recording are by chance 5 % off their mean, those of its copy again. So noise that is normal is
    drawn anew `DRAWS` times around the running mean; where its tails are heavier the extremes are those that were seen.
    """
    smooth = np.convolve(np.pad(left, WINDOW // 2, mode="edge"), np.full(WINDOW, 1 / WINDOW), "valid")
    noise = left - smooth
    variance = float(noise.var())
    if len(left) > 2 * WINDOW and variance > 0 and abs(float(np.mean(noise**4)) / variance**2 - 3) < TAILS:
        # Neighbouring rows hang together: the two parts together have the variance that was seen.
        size = np.sqrt(max(float(left.var() - smooth.var()), 0.0))
        drawn = [float(np.ptp(smooth + rng.normal(0.0, size, len(left)))) for _ in range(DRAWS)]
        return float(np.mean(drawn)), DRAWN * float(np.std(drawn))
    _, turn = np.unique(block, return_inverse=True)
    high, low = np.full(turn.max() + 1, -np.inf), np.full(turn.max() + 1, np.inf)
    np.maximum.at(high, turn, left)
    np.minimum.at(low, turn, left)
    draws = rng.integers(len(high), size=(RESAMPLES, len(high)))
    spread = float(np.std(high[draws].max(axis=1) - low[draws].min(axis=1)))
    return float(np.ptp(left)), SEEN * spread
