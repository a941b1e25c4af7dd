"""The error as a surface over input and output angle: on a grid, or as a few harmonics of both.

The circular spline's errors turn with the input angle a, the flexspline's with a + b, b the output angle: over the beat
of N input turns the error is one function F(a, b), 2 pi periodic in both. A table over one input turn would mix the
turns of a beat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hdopt.arrays import Array, Index

COARSE, FINE = (192, 96), (384, 192)
"""Grids of a surface. The coarse one has 1.9 deg of the input and 3.75 deg of the output: straight lines in between are
off by half a per cent of an amplitude of order 4; the fine one, of half the steps, is for single teeth."""
CELLS_PER_WAVE = 5
"""Cells of a table for a wave: straight lines between them leave a fifth of it, fewer hold nothing of it."""
DIMMEST = 0.5
"""Part of a wave that means of neighbouring samples leave from which on it is not made up for further."""


Spectrum: TypeAlias = tuple[Index, Index, NDArray[np.complex128]]
"""Orders k and j, and amplitudes, (m,) each."""


class Crossing(NamedTuple):
    """Output's travel `deg` over which the side of the return error crosses after a reversal (0: at once), and where it
    stood at the `start` of a recording: 1 on the side of the motion, -1 on the other, 0 between. `straight` for play,
    which crosses in a straight line and is over after `deg`; friction goes as exp(-travel/deg)."""

    deg: float = 0.0
    start: float = 1.0
    straight: bool = False


AT_ONCE = Crossing()


@dataclass(frozen=True)
class Harmonics:
    """Terms c cos(k a + j b) + s sin(k a + j b), arcmin: `k` and `j` (m,) whole, `cos` and `sin` (m,); `back` is half
    the return error, added forward and taken away backward, once it has crossed after a reversal as `crossing` says
    (`hdopt.compensation.path`)."""

    k: Index
    j: Index
    cos: Array
    sin: Array
    back: float = 0.0
    crossing: Crossing = AT_ONCE

    def __len__(self) -> int:
        return len(self.k)

    def __add__(self, more: Harmonics) -> Harmonics:
        """These terms and those of `more`; the return error is that of these."""
        orders = np.r_[self.k, more.k], np.r_[self.j, more.j]
        return Harmonics(*orders, np.r_[self.cos, more.cos], np.r_[self.sin, more.sin], self.back, self.crossing)

    def at(self, inputs: Array, outputs: Array, direction: Array | float = 0.0) -> Array:
        """Error (arcmin, n) at input and output angles `inputs`, `outputs` (n,) rad and `direction` +1, -1, 0 or the
        path between (`path_of`)."""
        value = np.zeros(np.shape(inputs)) + self.back * np.asarray(direction)
        whole = {order: np.exp(1j * order * outputs) for order in set(self.j.tolist())}
        for k in sorted(set(self.k.tolist())):
            terms = zip(self.j[self.k == k].tolist(), self.amplitudes[self.k == k].tolist(), strict=True)
            value += (np.exp(1j * k * inputs) * sum(size * whole[j] for j, size in terms)).real
        return np.asarray(value, float)

    def sharpened(self, ratio: float, width: float, count: int) -> Harmonics:
        """These terms before means of `count` even samples over `width` rad of the input, from which they were fitted,
        dimmed them; `ratio` is N."""
        half = np.abs(self.k + self.j / ratio) * width / 2
        seen = np.ones(len(half))
        turns = half > 0
        seen[turns] = np.sin(half[turns]) / (count * np.sin(half[turns] / count))
        seen = np.maximum(seen, DIMMEST)
        return replace(self, cos=self.cos / seen, sin=self.sin / seen)

    def for_table(self, cells: tuple[int, ...]) -> tuple[Harmonics, Harmonics]:
        """The terms that a table of `cells` holds between straight lines, with the return error, and those too fine."""
        holds = (np.abs(self.k) * CELLS_PER_WAVE <= cells[0]) & (np.abs(self.j) * CELLS_PER_WAVE <= cells[1])
        coarse, fine = (
            replace(self, **{name: getattr(self, name)[mask] for name in ("k", "j", "cos", "sin")})
            for mask in (holds, ~holds)
        )
        return coarse, replace(fine, back=0.0, crossing=AT_ONCE)

    @property
    def reach(self) -> float:
        """Peak-to-peak (arcmin) of all terms where they meet at their largest."""
        return 2 * float(np.abs(self.amplitudes).sum())

    @property
    def amplitudes(self) -> NDArray[np.complex128]:
        """c - i s of every term, (m,): the term is the real part of it times exp(i (k a + j b))."""
        return np.asarray(self.cos - 1j * self.sin, np.complex128)

    def on_grid(self, cells: tuple[int, ...]) -> Array:
        """Error (arcmin) without the return error on the points of `grid_angles` of `cells`, (n_input, n_output)."""
        a, b = (np.arange(count) * (2 * np.pi / count) for count in cells)
        inputs, outputs = np.exp(1j * np.outer(a, self.k)), np.exp(1j * np.outer(self.j, b))
        return np.asarray(((inputs * self.amplitudes) @ outputs).real, float)


def nothing(back: float = 0.0) -> Harmonics:
    """No harmonics; `back` is half the return error, arcmin."""
    return Harmonics(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros(0), back)


@dataclass(frozen=True)
class Grid:
    """The error at even steps, `values` (n_input, n) arcmin, mean zero, that straight lines join; a subclass says what
    the columns are. `back` and `crossing` as in `Harmonics`."""

    values: Array
    back: float = 0.0
    crossing: Crossing = AT_ONCE

    def __len__(self) -> int:
        return int(self.values.size)


@dataclass(frozen=True)
class Surface(Grid):
    """A grid over input and output angle, `values` (n_input, n_output)."""

    def at(self, inputs: Array, outputs: Array, direction: Array | float = 0.0) -> Array:
        """Error (arcmin, n) by straight lines between grid points at `inputs`, `outputs` (n,) rad and `direction`."""
        rows, columns = self.values.shape
        x = np.mod(inputs / (2 * np.pi), 1.0) * rows
        y = np.mod(outputs / (2 * np.pi), 1.0) * columns
        i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        p, q = x - i, y - j
        i0, i1, j0, j1 = i % rows, (i + 1) % rows, j % columns, (j + 1) % columns
        v = self.values
        low = v[i0, j0] * (1 - p) + v[i1, j0] * p
        high = v[i0, j1] * (1 - p) + v[i1, j1] * p
        return np.asarray(low * (1 - q) + high * q + self.back * np.asarray(direction), float)

    def on_grid(self, cells: tuple[int, ...]) -> Array:
        """Error (arcmin) without the return error on the points of `grid_angles` of `cells`, (n_input, n_output)."""
        return self.at(*grid_angles(cells))

    def harmonics(self, terms: int) -> Harmonics:
        """The `terms` largest harmonics of this surface, by its Fourier transform."""
        k, j, found = spectrum_of(self.values)
        keep = np.argsort(-np.abs(found), kind="stable")[:terms]
        chosen = found[keep]
        return Harmonics(k[keep], j[keep], 2 * chosen.real, -2 * chosen.imag, self.back, self.crossing)


def spectrum_of(values: Array) -> Spectrum:
    """Orders k, j and complex amplitudes (m,) of the harmonics of `values` (n_input, n_output) on the grid, without its
    mean: c = 2 Re, s = -2 Im of an amplitude are those of `Harmonics`."""
    rows, columns = values.shape
    spectrum = np.fft.fft2(values) / values.size
    k = np.fft.fftfreq(rows, 1 / rows).astype(np.int64)[:, None] * np.ones(columns, np.int64)
    j = np.ones((rows, 1), np.int64) * np.fft.fftfreq(columns, 1 / columns).astype(np.int64)
    upper = ((k > 0) | ((k == 0) & (j > 0))) & (np.abs(k) < rows // 2) & (np.abs(j) < columns // 2)
    return k[upper], j[upper], spectrum[upper]


def grid_angles(cells: tuple[int, ...] = COARSE) -> tuple[Array, Array]:
    """Input and output angles of the points of a grid of `cells`, both (n_input, n_output), rad."""
    a, b = (np.arange(count) * (2 * np.pi / count) for count in cells)
    inputs, outputs = np.meshgrid(a, b, indexing="ij")
    return np.asarray(inputs, float), np.asarray(outputs, float)


def surface_of(
    parts: Sequence[Harmonics], base: Array | None = None, back: float = 0.0, crossing: Crossing = AT_ONCE
) -> Surface:
    """The sum of `parts` on the grid, with a `base` already there (n_input, n_output); `back` half a return error and
    how it crosses after a reversal, `crossing`."""
    values = np.zeros(COARSE) if base is None else np.asarray(base, float).copy()
    for part in parts:
        values += part.on_grid(values.shape)
    return Surface(values - values.mean(), back, crossing)
