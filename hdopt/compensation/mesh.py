"""What single teeth add within their pitch: a table round each spline, finer than the waves of `teeth`.

A flank's form, and how it differs from tooth to tooth, ripples at the order of the mesh with sidebands of every
distance. Over a beat a record meets each place of a spline dozens of times, however its samples fall, and the splines
drift against each other: both tables together are a linear fit once it is known which zone drives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.compensation.surface import Grid, Harmonics
from hdopt.compensation.teeth import ALONE, CELLS, LOOSE, SHORTEST, STEPS, Teeth, beyond_waves, refit_waves
from hdopt.compensation.zones import MOST_TERMS, SMALL, Zones, in_terms, zone_values
from hdopt.effects.met import Spline, met_angles
from hdopt.effects.tooth_mesh import mesh_order
from hdopt.kinematics.cartesian import PARAMETERS
from hdopt.recordings.rows import Rows

PER_TOOTH = 8
"""Points of a table a tooth: straight lines between them leave 2 % of a sine over the pitch."""
ROWS_PER_TOOTH = 2.05
ROUNDS = 8
"""How often waves and tables are fitted in turn."""
ITERATIONS, ENOUGH = 30, 1e-4
"""Steps of the least squares for the tables, and the share of what is left at which they end."""
FORM = 0.003
"""mm: what stands on a flank, about; what no row shows stays near nothing."""
FIT_ROWS = 12_000
"""Rows that the waves are fitted to beside the tables."""
USUAL, STEP = 0.01, 0.002
"""mm: usual size of a drive's errors, and how far they move in a round."""
VALUES_PER_TURN = 4.0
"""Independent values an input turn in what the model leaves."""
SHARE = 4
"""One of so many coefficients at least is left to the mesh."""


def shows_mesh(rows: Rows) -> bool:
    """Whether `rows` are samples as they were recorded, more than twice a tooth, of a drive of a whole ratio."""
    dense = rows.rows_per_turn > ROWS_PER_TOOTH * mesh_order(rows.ratio)
    return dense and not rows.are_averages and abs(rows.ratio - round(rows.ratio)) < 1e-9


def fit_mesh(rows: Rows, free: Array, bare: Teeth) -> Teeth:
    """`bare`, the drive with nothing on its splines, with waves and a table round each of them, fitted to `rows`;
    `free` (n, q) are columns fitted beside it. For `rows` that `shows_mesh` agrees to."""
    count = round(PER_TOOTH * mesh_order(rows.ratio))
    waves = np.arange(2, SHORTEST + 1)
    some = slice(None, None, -(-len(rows) // FIT_ROWS))
    seen = rows.theta[some], rows.error[some]
    share = VALUES_PER_TURN * rows.span_turns / len(seen[0])
    found = replace(bare, errors=modest(bare, seen, free[some], share))
    for _ in range(ROUNDS):
        tables = _tables(rows, free, found, count)
        found = replace(found, cs=found.cs + _cells(tables[0]), fs=found.fs + _cells(tables[1]))
        found = refit_waves(found, seen, free[some], np.full(PARAMETERS, STEP**2 / LOOSE), waves, 1)
    return found


def _tables(rows: Rows, free: Array, found: Teeth, count: int) -> tuple[Array, Array]:
    """What `found` leaves of `rows` beside `free` columns, as tables (count,) mm round both splines.

    Which zone drove is as uncertain as what is left: a row speaks for both by their odds, or a place that handed over
    to the other zone by mistake would never be seen again.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import lsqr

    model, n = found.model, len(rows)
    basis, _ = np.linalg.qr(free)
    rotation = model.rotation(rows.theta)
    angles = met_angles(rows.theta, model.advance, model.beyond_at(rotation, found.errors))
    added = found.at_angles(angles)
    alone = np.stack([model.evaluate_at(rotation, found.errors, added - ALONE[1 - zone])[0] for zone in (0, 1)])
    ahead, error = alone[0] - alone[1], found.sense * rows.error
    left = error - alone.max(axis=0)
    size = max(float(np.std(left - basis @ (basis.T @ left))), 1e-9)
    left = left - size * np.log1p(np.exp(-np.abs(ahead) / size))
    left = (left - basis @ (basis.T @ left)) / model.arcmin_per_mm
    odds = 1 / (1 + np.exp(-np.clip(ahead / size, -50, 50)))
    columns, weights = [], []
    for spline in Spline:
        for zone, share in enumerate((odds, 1 - odds)):
            place = np.mod(angles[spline, zone] / (2 * np.pi), 1.0) * count
            whole = np.floor(place).astype(np.int64)
            columns += [spline * count + whole % count, spline * count + (whole + 1) % count]
            weights += [share * (1 - (place - whole)), share * (place - whole)]
    entries = np.concatenate(weights), (np.tile(np.arange(n), len(columns)), np.concatenate(columns))
    damp = size / model.arcmin_per_mm / FORM
    both = lsqr(csr_array(entries, (n, 2 * count)), left, damp, ENOUGH, ENOUGH, iter_lim=ITERATIONS)[0]
    return both[:count], both[count:]


def _cells(table: Array) -> Array:
    place = np.arange(CELLS) * (len(table) / CELLS)
    return np.asarray(np.interp(place, np.arange(len(table) + 1), np.append(table, table[0])), float)


def modest(bare: Teeth, seen: tuple[Array, Array], free: Array, share: float) -> Array:
    """Errors (12,) mm of the usual size that leave hardly more of `seen`, beside `free` columns, than those of `bare`.

    Eccentricities and sines of the teeth make nearly the same error, so that a fit may set large ones against each
    other; then the zones' places are off by more than a tooth. A `share` of the values is independent.
    """
    theta, error = seen
    rotation, errors = bare.model.rotation(theta), bare.errors
    basis, _ = np.linalg.qr(free)

    def without(columns: Array) -> Array:
        return np.asarray(columns - basis @ (basis.T @ columns), float)

    def left(tried: Array) -> Array:
        return without(bare.sense * error - bare.model.evaluate_at(rotation, tried)[0])

    weight = share / float(np.mean(left(errors) ** 2))

    def cost(tried: Array) -> float:
        return weight * float(np.sum(left(tried) ** 2)) + float(np.sum(tried**2)) / USUAL**2

    for _ in range(ROUNDS):
        slopes = without(bare.model.evaluate_at(rotation, errors)[2])
        inner = weight * slopes.T @ slopes + np.eye(PARAMETERS) / USUAL**2
        step = np.linalg.solve(inner, weight * slopes.T @ left(errors) - errors / USUAL**2)
        least, part = min((cost(errors + part * step), part) for part in STEPS)
        if least >= cost(errors):
            break
        errors = errors + part * step
    return errors


@dataclass(frozen=True)
class Beat(Grid):
    """A grid over a whole beat, `values` (n_input, N): even steps of the input in every input turn of the output's
    turn."""

    def at(self, inputs: Array, outputs: Array, direction: Array | float = 0.0) -> Array:
        """Error (arcmin, n) by straight lines along the input at `inputs`, `outputs` (n,) rad and `direction`; the
        output angle says which input turn it is."""
        rows, turns = self.values.shape
        within = np.mod(inputs / (2 * np.pi), 1.0)
        turn = np.rint(outputs / (2 * np.pi) * turns - within).astype(np.int64) % turns
        place = np.floor(within * rows).astype(np.int64)
        share, here = within * rows - place, turn * rows + place
        flat = self.values.T.ravel()
        value = flat[here % flat.size] * (1 - share) + flat[(here + 1) % flat.size] * share
        return np.asarray(value + self.back * np.asarray(direction), float)


def beat_of(teeth: Teeth, rest: Harmonics, ratio: float) -> Beat:
    """The table over the beat of `teeth` and the `rest`, which has the return error, for a whole `ratio`."""
    turns, rows = round(ratio), round(PER_TOOTH * mesh_order(ratio))
    theta = _even(rows * turns, rows)
    values = teeth.at(theta) + rest.at(theta, theta / ratio)
    return Beat((values - values.mean()).reshape(turns, rows).T, rest.back, rest.crossing)


def _even(count: int, per_turn: int) -> Array:
    return np.asarray(np.arange(count) * (2 * np.pi / per_turn), float)


def largest(values: Array, ratio: float, terms: int) -> Harmonics:
    """The `terms` largest harmonics of `values` (n,) arcmin at even steps over a beat of a whole `ratio`."""
    turns = round(ratio)
    found = np.fft.rfft(values) / len(values)
    cycles = 1 + np.argsort(-np.abs(found[1:-1]), kind="stable")[:terms]
    k = np.rint(cycles / turns).astype(np.int64)
    return Harmonics(k, cycles - turns * k, 2 * found[cycles].real, -2 * found[cycles].imag)


def formed_mesh(
    teeth: Teeth, rest: Harmonics, terms: int | None, left: float, ratio: float
) -> tuple[Zones | Harmonics | Beat, float]:
    """`formed` for `teeth` with their mesh and a whole `ratio`; `rest`, `terms`, `left` and the answer as there."""
    table = beat_of(teeth, rest, ratio)
    if terms == 0:
        return table, 0.0
    most = MOST_TERMS if terms is None else terms
    alone = np.arange(2, SHORTEST + 1)
    waves = replace(teeth, cs=teeth.cs - beyond_waves(teeth.cs, alone), fs=teeth.fs - beyond_waves(teeth.fs, alone))
    theta = _even(table.values.size, table.values.shape[0])
    few = in_terms(zone_values(waves), rest, waves.sense, most - most // SHARE)
    mesh = largest(teeth.at(theta) - waves.at(theta), ratio, most - len(few))
    found = replace(few, rest=few.rest + mesh) if isinstance(few, Zones) else few + mesh
    off = float(np.ptp(found.at(theta, theta / ratio) - table.values.T.ravel()))
    return (found, off) if terms is not None or off < SMALL * left else (table, 0.0)
