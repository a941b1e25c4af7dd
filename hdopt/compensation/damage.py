"""One damaged tooth found in a record: its place, width and height beside the drive's errors and waves of its teeth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.compensation.mesh import STEP, USUAL, VALUES_PER_TURN, modest
from hdopt.compensation.pulse import Damage
from hdopt.compensation.teeth import CELLS, LOOSE, MOST_ROWS, ROWS_PER_WAVE, SHORTEST, STEPS, Teeth, refit_waves
from hdopt.effects.met import Spline, off_centre
from hdopt.effects.tooth_mesh import mesh_order
from hdopt.kinematics.cartesian import PARAMETERS, CartesianModel
from hdopt.recordings.rows import Rows

HALF_WIDTHS = (1.0, 2.0, 3.0)
"""Of a triangle, teeth: a tooth alone, with half as much on its neighbours, a group of three."""
PLACES, HEIGHTS = (-1.0, -0.5, 0.0, 0.5, 1.0), (1.0, 1.7, 3.0)
"""Where a fit begins, teeth off what its waves say, and how high, beside what they say."""
STANDS_OUT = 0.2
"""Share of a spline's waves that a pulse must be before it is tried."""
NARROWEST, WIDEST = 0.5, 4.0
"""Half widths that are fitted, teeth."""
CLEAR = 4.5
"""Teeth either side of a damaged one within which a row may have met it."""
AGAIN, LONG, ROUNDS = 2, 8, 6
"""How often tooth and waves are fitted in turn, and rounds of either."""
NUDGE, NUDGE_MM = 0.02, 1e-4
"""Steps of a slope: teeth, and mm of height."""


def stands_out(teeth: Teeth, pitches: tuple[float, float]) -> Damage | None:
    """The triangle that takes most of the waves round one of the splines of `teeth`; None where none is plain.
    `pitches` of the circular spline and the flexspline, rad."""
    best, most = None, STANDS_OUT
    for spline, table, pitch in zip(Spline, (teeth.cs, teeth.fs), pitches, strict=True):
        waves = np.fft.rfft(np.broadcast_to(table, CELLS))
        waves[:2], waves[SHORTEST + 1 :] = 0, 0
        power = float(np.sum(np.abs(waves) ** 2))
        for teeth_wide in HALF_WIDTHS:
            shape = np.fft.rfft(Damage(spline, 0.0, teeth_wide * pitch, 1.0).table())
            shape[:2], shape[SHORTEST + 1 :] = 0, 0
            size = float(np.sum(np.abs(shape) ** 2))
            match = np.fft.irfft(waves * np.conj(shape), CELLS) * (CELLS / 2)
            place = int(np.argmax(np.abs(match)))
            height = float(match[place]) / size
            share = height**2 * size / max(power, 1e-300)
            if share > most:
                best, most = Damage(spline, place * 2 * math.pi / CELLS, teeth_wide * pitch, height), share
    return best


def fit_damage(rows: Rows, free: Array, bare: Teeth, waved: Teeth) -> tuple[Teeth, Damage] | None:
    """What the drive `bare` has besides one damaged tooth, as waves, and that tooth, fitted to `rows`; None where no
    tooth stands out of `waved`, the same drive with waves alone. `free` (n, q) are columns beside it.

    Waves and a pulse draw the drive's errors to themselves: these are fitted where no zone meets the tooth first.
    """
    pitch = 2 * math.pi / mesh_order(rows.ratio)
    pitches = pitch, pitch * bare.model.advance
    first = stands_out(waved, pitches)
    if first is None:
        return None
    some = slice(None, None, -(-len(rows) // MOST_ROWS))
    seen = rows.theta[some], rows.error[some]
    row = 2 * math.pi / rows.rows_per_turn if rows.averaged > 1 else 0.0
    longest = max(2, min(SHORTEST, int(rows.rows_per_turn / ROWS_PER_WAVE)))
    waves = np.arange(2, longest + 1)
    clear = ~_touched(bare.model, seen[0], first, pitches)
    apart = seen[0][clear], seen[1][clear]
    share = VALUES_PER_TURN * rows.span_turns / len(seen[0])
    near = bare.errors
    for _ in range(2):
        near = modest(replace(bare, errors=near), apart, free[some][clear], share)
    # How far the other zone lies behind shows only where the tooth lifts it into driving.
    variance, free_errors = (np.full(PARAMETERS, size**2 / LOOSE) for size in (STEP, USUAL))
    start = refit_waves(replace(bare, errors=near), apart, free[some][clear], variance, waves)
    under, damage = start, first
    for _ in range(AGAIN):
        damage = _moved(under, damage, (seen[0][~clear], seen[1][~clear]), free[some][~clear], row, pitches)
        base = _tables(damage, row)
        whole = refit_waves(damage.on(under, row), seen, free[some], free_errors, waves, LONG, base)
        under = replace(whole, cs=whole.cs - base[0], fs=whole.fs - base[1])
    return under, damage


def _touched(model: CartesianModel, theta: Array, damage: Damage, pitches: tuple[float, float]) -> Mask:
    """Where a zone may meet the `damage` at input angles `theta` (n,) rad."""
    turned = theta * (model.advance if damage.spline is Spline.FLEX else 1.0)
    off = np.abs(off_centre(turned, damage.centre, math.pi))
    return np.asarray(off < CLEAR * pitches[damage.spline], np.bool_)


def _tables(damage: Damage, row: float) -> tuple[Array, Array]:
    nothing = np.zeros(CELLS)
    return (damage.table(row), nothing) if damage.spline is Spline.CIRCULAR else (nothing, damage.table(row))


def _moved(
    under: Teeth, damage: Damage, seen: tuple[Array, Array], free: Array, row: float, pitches: tuple[float, float]
) -> Damage:
    """`damage` where it leaves least of `seen`, angles (n,) rad and errors (n,) arcmin, on top of `under`, beside
    `free` (n, q): its height, place and width, by Gauss and Newton from the best of several; `row` rad is a mean's.

    Where a tooth is too low another zone drives, and nothing tells that it is higher. Which of both zones drives a
    record may not tell but by the tooth: it may as well stand half a turn on.
    """
    theta, error = seen
    basis, _ = np.linalg.qr(free)
    pitch = pitches[damage.spline]

    def left(one: Damage) -> Array:
        rest = error - one.on(under, row).at(theta)
        return np.asarray(rest - basis @ (basis.T @ rest), float)

    begun = [
        Damage(damage.spline, damage.centre + off * pitch + half, wide * pitch, damage.height * times)
        for half in (0.0, math.pi)
        for off in PLACES
        for wide in HALF_WIDTHS
        for times in HEIGHTS
    ]
    damage = min((damage, *begun), key=lambda one: float(np.sum(left(one) ** 2)))
    rest = left(damage)
    for _ in range(ROUNDS):
        h = NUDGE * pitch
        tried = [
            (replace(damage, height=damage.height + NUDGE_MM), NUDGE_MM),
            (replace(damage, centre=damage.centre + h), h),
            (replace(damage, half_width=damage.half_width + h), h),
        ]
        slopes = np.column_stack([(rest - left(one)) / by for one, by in tried])
        step = np.linalg.lstsq(slopes, rest, rcond=1e-8)[0]
        step[1:] = np.clip(step[1:], -pitch, pitch)
        moved = [
            Damage(
                damage.spline,
                damage.centre + part * float(step[1]),
                float(np.clip(damage.half_width + part * float(step[2]), NARROWEST * pitch, WIDEST * pitch)),
                damage.height + part * float(step[0]),
            )
            for part in STEPS
        ]
        squares = [float(np.sum(left(one) ** 2)) for one in moved]
        if min(squares) >= float(rest @ rest):
            break
        damage = moved[int(np.argmin(squares))]
        rest = left(damage)
    return damage
