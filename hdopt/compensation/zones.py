"""The error as what two meshing zones make: the larger of two sums of harmonics, whose kinks no single sum follows.

The zone that deviates more drives (Jia 2021, Sec. 3). Each zone's deviation is smooth in both angles, so a dozen
harmonics carry it; where the driving zone changes their larger value has a kink, of which a single sum of 64 harmonics
leaves a tenth of the error's peak-to-peak.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.compensation.pulse import COEFFICIENTS, Damage, Pulse
from hdopt.compensation.surface import (
    COARSE,
    FINE,
    Crossing,
    Harmonics,
    Spectrum,
    Surface,
    grid_angles,
    spectrum_of,
    surface_of,
)
from hdopt.compensation.teeth import Teeth

LEAST = 1e-5
"""Harmonics below this part of the largest are not worth a line of the table."""
MOST_TERMS = 64
EVERY = 3
"""Forms are compared at every third point of a grid each way: whole steps and halves of one half as fine."""
BEAT = 30_000
"""Places round a beat at which a form with a damaged tooth is compared: some ten on a tooth at 80:1."""
SMALL = 0.05
"""Share of the peak-to-peak that is left anyway by which a form may be off."""


@dataclass(frozen=True)
class Zones:
    """What two meshing zones make, `first` and `second`, arcmin: the larger drives, or the smaller where `sense` is -1
    (the angles count the other way round), each with its `pulses`; `rest` is added to it, with the return error."""

    first: Harmonics
    second: Harmonics
    rest: Harmonics
    sense: float = 1.0
    pulses: tuple[Pulse, ...] = ()

    def __len__(self) -> int:
        return len(self.first) + len(self.second) + len(self.rest) + COEFFICIENTS * len(self.pulses)

    @property
    def back(self) -> float:
        return self.rest.back

    @property
    def crossing(self) -> Crossing:
        return self.rest.crossing

    def at(self, inputs: Array, outputs: Array, direction: Array | float = 0.0) -> Array:
        """Error (arcmin, n) at input and output angles `inputs`, `outputs` (n,) rad and `direction` +1, -1, 0 or the
        path between (`path_of`)."""
        both = [self.first.at(inputs, outputs), self.second.at(inputs, outputs)]
        for pulse in self.pulses:
            both[pulse.zone] = both[pulse.zone] + pulse.at(inputs, outputs)
        larger = np.maximum(*both) if self.sense > 0 else np.minimum(*both)
        return np.asarray(larger + self.rest.at(inputs, outputs, direction), float)

    def on_grid(self, cells: tuple[int, ...]) -> Array:
        """Error (arcmin) without the return error on the points of `grid_angles` of `cells`, (n_input, n_output)."""
        both = np.stack([self.first.on_grid(cells), self.second.on_grid(cells)])
        for pulse in self.pulses:
            both[pulse.zone] += pulse.at(*grid_angles(cells))
        return np.asarray(driving(both, self.sense) + self.rest.on_grid(cells), float)


def zone_values(teeth: Teeth, cells: tuple[int, int] = COARSE) -> Array:
    """What each zone of `teeth` would make if it drove alone, on a grid of `cells` over input and output angle,
    arcmin, (2, n_input, n_output); the mean of the driving one is zero."""
    inputs, outputs = grid_angles(cells)
    values = teeth.zones(np.stack([inputs.ravel(), (inputs + outputs).ravel()])).reshape(2, *cells)
    return np.asarray(values - driving(values, teeth.sense).mean(), float)


def driving(values: Array, sense: float) -> Array:
    """The error (n_input, n_output) that the zones' `values` (2, n_input, n_output) make, `sense` as in `Zones`."""
    return np.asarray(values.max(axis=0) if sense > 0 else values.min(axis=0), float)


def in_terms(values: Array, rest: Harmonics, sense: float, terms: int) -> Zones | Harmonics:
    """At most `terms` harmonics for the zones' `values` (2, n_input, n_output) arcmin and `rest`, which has the return
    error; `sense` as in `Zones`. The larger of two sums, or one sum where so few terms leave less that way."""
    held, fine = rest.for_table(values.shape[1:])
    both = surface_of([held], driving(values, sense), rest.back, rest.crossing)
    one = both.harmonics(max(terms - len(fine), 0)) + fine
    if terms - len(rest) - len(values) <= 0:
        return one
    two = _two(values, rest, sense, terms)
    whole = surface_of([fine], both.values)
    return two if np.std(_off(two, whole)) < np.std(_off(one, whole)) else one


def _two(values: Array, rest: Harmonics, sense: float, terms: int) -> Zones:
    """`in_terms` as the larger of two sums, for so many `terms` that some are left for them."""
    spectra = [spectrum_of(zone) for zone in values]
    left = terms - len(rest) - len(values)
    sizes = np.sort(np.concatenate([np.abs(found) for _, _, found in spectra]))[::-1]
    least = max(float(sizes[min(left, len(sizes) - 1)]), LEAST * float(sizes[0]))
    zones = [_kept(spectrum, float(zone.mean()), least) for spectrum, zone in zip(spectra, values, strict=True)]
    return Zones(zones[0], zones[1], rest, sense)


def _kept(spectrum: Spectrum, mean: float, least: float) -> Harmonics:
    """The harmonics of a `spectrum` larger than `least`, and the `mean`."""
    k, j, found = spectrum
    keep = np.flatnonzero(np.abs(found) > least)
    zero = np.zeros(1, np.int64)
    chosen = found[keep]
    return Harmonics(
        np.r_[zero, k[keep]], np.r_[zero, j[keep]], np.r_[mean, 2 * chosen.real], np.r_[0.0, -2 * chosen.imag]
    )


def _off(found: Zones | Harmonics | Surface, surface: Surface) -> Array:
    """What `found` is off the `surface` (arcmin) at some of its points."""
    some = surface.values[::EVERY, ::EVERY]
    return np.asarray(found.on_grid(some.shape) - some, float)


def formed(teeth: Teeth, rest: Harmonics, terms: int | None, left: float) -> tuple[Zones | Harmonics | Surface, float]:
    """What a controller takes of `teeth` and the `rest`, which has the return error: at most `terms` harmonics, a table
    where that is 0; and how far that is off both (arcmin, peak-to-peak).

    With None `MOST_TERMS`, but a table where so few would be off by more than `SMALL` of the peak-to-peak that is
    `left` (arcmin) anyway; the finer of two grids where the coarser is.
    """
    fine = zone_values(teeth, FINE)
    held, lost = rest.for_table(COARSE)
    table = surface_of([held], driving(fine, teeth.sense), rest.back, rest.crossing)
    if terms != 0:
        found = in_terms(fine[:, ::2, ::2], rest, teeth.sense, MOST_TERMS if terms is None else terms)
        # The terms too fine for a table are in what was found as they are: off is what the others are.
        off = float(np.ptp(_off(found, surface_of([rest], driving(fine, teeth.sense)))))
        if terms is not None or off < max(SMALL * left, lost.reach):
            return found, off
    coarse = replace(table, values=table.values[::2, ::2])
    off = float(np.ptp(_off(coarse, table)))
    return (coarse, off + lost.reach) if off < SMALL * left else (table, lost.reach)


def formed_damaged(
    teeth: Teeth, damage: Damage, rest: Harmonics, terms: int | None, left: float
) -> tuple[Zones | Harmonics | Surface, float]:
    """`formed` for `teeth` with one tooth's `damage`, whose pulses count as `COEFFICIENTS` each; `rest`, `terms`,
    `left` and the answer as there."""
    most = MOST_TERMS if terms is None else terms
    pulses = damage.met(teeth.model, teeth.errors, teeth.sense)
    room = most - COEFFICIENTS * len(pulses)
    if room - len(rest) <= 2:
        return formed(damage.on(teeth), rest, terms, left)
    values = zone_values(teeth)
    found = replace(_two(values, rest, teeth.sense, room), pulses=pulses)
    ratio = 1 / (teeth.model.advance - 1)
    theta = np.linspace(0.0, 2 * np.pi * ratio, BEAT)
    off = found.at(theta, theta / ratio) - damage.on(teeth).at(theta) - rest.at(theta, theta / ratio)
    return found, float(np.ptp(off))
