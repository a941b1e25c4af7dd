"""The extended model of one drive: its waveform, with effects, at an operating condition."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.effects.met import Met, met_angles, sum_of
from hdopt.effects.term import Term
from hdopt.errors import MissingValue
from hdopt.kinematics.branches import DeepestPoints
from hdopt.kinematics.waveform import deviation_at, full_turn, geometry_for, relative_turn_points
from hdopt.simulation.effect_values import EffectValues
from hdopt.simulation.operation import NO_LOAD, Operation

FEWEST_PER_TURN, MOST_PER_TURN = 720, 8192
PER_PERIOD = 16
"""Samples in a period of the highest order, up to `MOST_PER_TURN` in a turn."""
FEWEST_PER_PERIOD = 8
"""With fewer than this an effect counts as too fine for a grid over the relative turn."""


@dataclass(frozen=True)
class ExtendedModel:
    """One drive's errors with `effects` beside them, at `operation`.

    Effects of the meshing zones add to the deviation of each zone before the larger one drives (Jia 2021, Eqs. (31),
    (32)), those of the splines where the zone's deepest point meets them, as the base's own teeth do; the others add to
    the kinematic error itself. `homogenization` is k_e, which evens out the driving deviation only; where teeth
    are measured, each of its terms in its own way (`kinematics.load_sharing`). `geometry` is that of
    `hdopt.kinematics.waveform`. Raises `MissingValue` where an effect needs a number that `operation` does not have.
    """

    drive: Drive
    errors: DriveErrors
    effects: tuple[EffectValues, ...]
    operation: Operation = NO_LOAD
    homogenization: float = 1.0
    geometry: str = "exact"

    def __post_init__(self) -> None:
        for effect in self.effects:
            missing = [key for name, key in effect.needs.items() if getattr(self.operation, name) is None]
            if missing:
                raise MissingValue(f"the effect {effect.id}", *(f"operation.{key}" for key in missing))

    @property
    def ratio(self) -> float:
        return self.drive.geometry.ratio

    @property
    def span(self) -> float:
        """Input angle of one full relative turn of FS and CS, rad."""
        return 2 * math.pi * self.drive.geometry.beat_phases

    @property
    def samples_per_turn(self) -> int:
        """Enough samples a turn for the orders of all effects, as far as a grid can hold them."""
        highest = max((effect.highest_order(self.ratio) for effect in self.effects), default=0.0)
        return int(np.clip(math.ceil(PER_PERIOD * highest), FEWEST_PER_TURN, MOST_PER_TURN))

    @property
    def too_fine(self) -> tuple[EffectValues, ...]:
        """Effects whose ripple is finer than the grid over the relative turn resolves."""
        most = self.samples_per_turn / FEWEST_PER_PERIOD
        return tuple(effect for effect in self.effects if effect.highest_order(self.ratio) > most)

    def with_effects(self, effects: Sequence[EffectValues]) -> ExtendedModel:
        """The same drive with these effects only."""
        return replace(self, effects=tuple(effects))

    def waveform(self, theta: Array, direction: float = 1.0) -> Array:
        """Kinematic error (arcmin) at input angles `theta` (rad, shape (n,), within one relative turn) passed in
        `direction`; shape (n,)."""
        theta = np.mod(theta, self.span)
        points = geometry_for(self.drive, self.geometry)(self.drive, self.errors, theta)
        return self.driven(theta, points, direction) + self.beside(theta, direction)

    def relative_turn(self, direction: float = 1.0) -> tuple[Array, Array]:
        """Input angles (rad) of one full relative turn and the kinematic error there (arcmin); shapes (n,)."""
        theta, points = relative_turn_points(self.drive, self.errors, self.samples_per_turn, self.geometry)
        return theta, self.driven(theta, points, direction) + self.beside(theta, direction)

    def driven(self, theta: Array, points: DeepestPoints, direction: float = 1.0) -> Array:
        """What the driving zone makes of the base's deviation and the zones' effects, arcmin, shape (n,); `points` are
        the deepest ones at `theta`, rad."""
        misalignment, sines, zones, whole = self._shares
        deviation = deviation_at(self.drive, self.errors, theta, points, misalignment, sines)
        driving = np.max(deviation + zones * self.in_zones(theta, points, direction), axis=0)
        return np.asarray(whole * self.drive.geometry.arcmin_per_mm * driving)

    @cached_property
    def _shares(self) -> tuple[float, float, float, float]:
        """What the teeth in contact leave of misalignment, of sines, of the zones' effects, and of all together: k_e
        of all; but where teeth are measured, whose mean stands in their table, misalignment by its own mean."""
        k_e = self.homogenization
        if k_e == 1 or not self.drive.has_measured_teeth:
            return 1.0, 1.0, 1.0, k_e
        from hdopt.kinematics.load_sharing import misalignment_share

        return misalignment_share(self.drive), k_e, k_e, 1.0

    def in_zones(self, theta: Array, points: DeepestPoints, direction: float = 1.0) -> Array:
        """What effects add to the deviation of each meshing zone, mm of arc, shape (2, n); `points` are the
        deepest ones at `theta`, rad."""
        added = self.fixed_in_zones(theta, direction)
        if found := self.on_splines(direction):
            added += sum_of(found, met_angles(theta, self.drive.geometry.flexspline_advance, points.beyond))[0]
        return added

    def fixed_in_zones(self, theta: Array, direction: float = 1.0) -> Array:
        """What of the same the input angles `theta` (n,), rad, alone decide, mm of arc, shape (2, n)."""
        added = np.zeros((2, len(theta)))
        for effect, term in self._terms(theta, direction):
            if term.zones is not None:
                added += self.operation.of_pass(term.zones @ np.array(effect.coefficients))
        return added

    def on_splines(self, direction: float = 1.0) -> list[tuple[Met, Array]]:
        """The deviations on the splines, with their coefficients."""
        terms = self._terms(np.array([0.0, self.span]), direction)
        return [(term.met, np.array(effect.coefficients)) for effect, term in terms if term.met is not None]

    def beside(self, theta: Array, direction: float = 1.0) -> Array:
        """What effects add to the kinematic error outside the zones, arcmin, shape (n,)."""
        added = sum((values for _, values in self._columns(theta, direction)), np.zeros(len(theta)))
        for grid, values in self._settled.get(direction, ()):
            added += np.interp(theta, grid, values, period=self.span)
        return added

    def _columns(self, theta: Array, direction: float) -> Iterator[tuple[EffectValues, Array]]:
        """The effects that add to the kinematic error itself, and what each adds, arcmin, (n,)."""
        for effect, term in self._terms(theta, direction):
            if term.columns is not None:
                yield effect, self.operation.of_pass(term.columns @ np.array(effect.coefficients))

    def _terms(self, theta: Array, direction: float) -> list[tuple[EffectValues, Term]]:
        rows = self.operation.conditions(self.ratio, theta, direction, self.span)
        return [(effect, effect.term(rows)) for effect in self.effects if not effect.follows_base]

    @cached_property
    def _settled(self) -> dict[float, tuple[tuple[Array, Array], ...]]:
        """Of the effects that follow the base: (angles, arcmin) over one relative turn, by direction."""
        followers = [effect for effect in self.effects if effect.follows_base]
        if not followers:
            return {}
        theta, points = relative_turn_points(self.drive, self.errors, self.samples_per_turn, self.geometry)
        # Each direction runs on by itself here: what a reversal stirs up dies away and is left out.
        running = replace(self.operation, motion="forward")
        settled = {}
        for direction in self.operation.directions:
            order = slice(None, None, int(direction))
            moving = [values for effect, values in self._columns(theta, direction) if effect.moves_the_output]
            excitation = sum(moving, self.driven(theta, points, direction))[order]
            rows = running.conditions(self.ratio, full_turn(self.drive, self.samples_per_turn), 1.0, self.span)
            settled[direction] = tuple(
                (theta, (effect.term(rows, excitation).columns @ np.array(effect.coefficients))[order])
                for effect in followers
            )
        return settled
