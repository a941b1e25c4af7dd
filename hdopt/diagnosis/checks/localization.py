"""Where a residual lives: its size in each domain, with the chance that noise alone would look like that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdopt.diagnosis.inference.generic_basis import generic_columns
from hdopt.diagnosis.inference.normal_equations import sums_of_groups
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import RIDGE, TINY


@dataclass(frozen=True)
class Location:
    """Structure in one domain: rms (arcmin) of what its smooth columns explain beside the model, and its p by sign
    flips of whole turns.
    """

    domain: str
    rms_arcmin: float
    p: float

    def to_dict(self) -> dict[str, object]:
        return {"domain": self.domain, "rms_arcmin": self.rms_arcmin, "p": self.p}


def locate(probe: FitProbe, rng: np.random.Generator) -> list[Location]:
    """Structure of the residual of `probe` by domain, largest first, by sign flips drawn from `rng`: orders (whole,
    output-synchronous, asynchronous), direction, path after a reversal, torque, speed, temperature, time.
    """
    columns, domains = generic_columns(probe.rows, probe)
    block, flips = probe.rows.block, probe.fit.problem.settings.held_out.locate_flips
    signs = rng.choice([-1.0, 1.0], size=(flips, int(block[-1]) + 1))
    found = []
    taken = probe.fit.design()
    for domain in dict.fromkeys(domains):
        raw = columns[:, [i for i, d in enumerate(domains) if d == domain]]
        white = probe.project(probe.noise.whiten(raw))
        norm = np.sqrt(np.maximum((white**2).sum(0), TINY))
        white = white / norm
        gram = white.T @ white + RIDGE * np.eye(white.shape[1])
        scores = sums_of_groups(white, block, probe.white_residual, signs.shape[1])
        total = scores.sum(0)
        solution = np.linalg.solve(gram, total)
        flipped = signs @ scores
        gains = np.einsum("ri,ri->r", flipped, np.linalg.solve(gram, flipped.T).T)
        p = float((1 + np.sum(gains >= total @ solution)) / (1 + flips))
        # Of sums of columns that base and offsets nearly absorb, only what they leave is there to be seen.
        explained = raw / norm @ solution
        explained -= taken @ np.linalg.lstsq(taken, explained, rcond=None)[0]
        found.append(Location(domain, float(np.std(explained)), p))
    return sorted(found, key=lambda location: -location.rms_arcmin)
