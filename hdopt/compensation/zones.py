"""The error as what two meshing zones make: the larger of two sums of harmonics, whose kinks no single sum follows.

The zone that deviates more drives (Jia 2021, Sec. 3). Each zone's deviation is smooth in both angles, so a dozen
harmonics carry it; where the driving zone changes their larger value has a kink, of which a single sum of 64 harmonics
leaves a tenth of the error's peak-to-peak.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.compensation.surface import Harmonics, Spectrum, Surface, grid_angles, spectrum_of, surface_of
from hdopt.kinematics.cartesian import CartesianModel

LEAST = 1e-5
"""Harmonics below this part of the largest are not worth a line of the table."""
ALONE = 1e3
"""mm by which a zone is set back so that the other one drives."""


@dataclass(frozen=True)
class Zones:
    """What two meshing zones make, `first` and `second`, arcmin: the larger drives, or the smaller where `sense` is -1
    (the angles count the other way round); `rest` is added to it, with the return error."""

    first: Harmonics
    second: Harmonics
    rest: Harmonics
    sense: float = 1.0

    def __len__(self) -> int:
        return len(self.first) + len(self.second) + len(self.rest)

    @property
    def back(self) -> float:
        return self.rest.back

    @property
    def crossing_deg(self) -> float:
        return self.rest.crossing_deg

    def at(self, inputs: Array, outputs: Array, direction: Array | float = 0.0) -> Array:
        """Error (arcmin, n) at input and output angles `inputs`, `outputs` (n,) rad and `direction` +1, -1, 0 or the
        path between (`path_of`)."""
        first, second = self.first.at(inputs, outputs), self.second.at(inputs, outputs)
        larger = np.maximum(first, second) if self.sense > 0 else np.minimum(first, second)
        return np.asarray(larger + self.rest.at(inputs, outputs, direction), float)


def zone_values(model: CartesianModel, errors: Array, sense: float) -> Array:
    """What each zone of `model` with `errors` (12,) mm would make if it drove alone, on the grid, arcmin, (2, n_input,
    n_output), times `sense` (+1 or -1); the mean of the driving one is zero."""
    inputs, outputs = grid_angles()
    a, b = inputs.ravel(), (inputs + outputs).ravel()
    rotation = np.stack([np.cos(a), np.sin(a), np.cos(b), np.sin(b)])
    alone = [
        model.evaluate_at(rotation, errors, np.array([[-ALONE * (zone == 1)], [-ALONE * (zone == 0)]]))[0]
        for zone in (0, 1)
    ]
    values = np.stack(alone).reshape(2, *inputs.shape)
    return np.asarray(sense * (values - values.max(axis=0).mean()), float)


def driving(values: Array, sense: float) -> Array:
    """The error (n_input, n_output) that the zones' `values` (2, n_input, n_output) make, `sense` as in `Zones`."""
    return np.asarray(values.max(axis=0) if sense > 0 else values.min(axis=0), float)


def in_terms(values: Array, rest: Harmonics, sense: float, terms: int) -> Zones | Harmonics:
    """At most `terms` harmonics for the zones' `values` (2, n_input, n_output) arcmin and `rest`, which has the return
    error; `sense` as in `Zones`. The larger of two sums, or one sum where so few terms leave less that way."""
    both = surface_of([rest], driving(values, sense), rest.back, rest.crossing_deg)
    one = both.harmonics(terms)
    spectra = [spectrum_of(zone) for zone in values]
    means = [float(zone.mean()) for zone in values]
    left = terms - len(rest) - len(values)
    if left <= 0:
        return one
    sizes = np.sort(np.concatenate([np.abs(found) for _, _, found in spectra]))[::-1]
    least = max(float(sizes[min(left, len(sizes) - 1)]), LEAST * float(sizes[0]))
    zones = [_kept(spectrum, mean, least) for spectrum, mean in zip(spectra, means, strict=True)]
    two = Zones(zones[0], zones[1], rest, sense)
    return two if _off(two, both) < _off(one, both) else one


def _kept(spectrum: Spectrum, mean: float, least: float) -> Harmonics:
    """The harmonics of a `spectrum` larger than `least`, and the `mean`."""
    k, j, found = spectrum
    keep = np.flatnonzero(np.abs(found) > least)
    zero = np.zeros(1, np.int64)
    chosen = found[keep]
    return Harmonics(
        np.r_[zero, k[keep]], np.r_[zero, j[keep]], np.r_[mean, 2 * chosen.real], np.r_[0.0, -2 * chosen.imag]
    )


def _off(found: Zones | Harmonics, surface: Surface) -> float:
    inputs, outputs = grid_angles()
    return float(np.std(found.at(inputs.ravel(), outputs.ravel()) - surface.values.ravel()))
