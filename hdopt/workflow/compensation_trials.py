"""The ways to compensate, each fitted to parts of the recordings and tried on the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array, Index, Mask
from hdopt.compensation.damage import fit_damage
from hdopt.compensation.fine import LEAST_TURNS
from hdopt.compensation.mesh import ROWS_PER_TOOTH, fit_mesh, formed_mesh, shows_mesh
from hdopt.compensation.of_speed import Angular, OfSpeed, signed_rpm
from hdopt.compensation.path import Paths, crossing_of, half_return, path_of, some_of
from hdopt.compensation.pursuit import dictionary, independent_share, pursue
from hdopt.compensation.surface import AT_ONCE, COARSE, Crossing, nothing, surface_of
from hdopt.compensation.teeth import Teeth, fit_teeth
from hdopt.compensation.writers import Found
from hdopt.compensation.zones import MOST_TERMS, formed, formed_damaged
from hdopt.drive.geometry import Drive
from hdopt.effects.tooth_mesh import mesh_order
from hdopt.recordings.recording import TURN, Recording
from hdopt.recordings.rows import Rows, neighbours_for, recorded_turns
from hdopt.workflow.compensation_samples import Samples
from hdopt.workflow.waveform_fit import WaveformFit, fit_rows, offset_columns

FOLDS = 4
PIECES = 3
"""Stretches of a single pass that each part holds: one long gap asks a fit to guess a quarter of the output's turn."""
FIT_ROWS = 10_000
"""Rows that the twelve errors are fitted to, evenly spread."""
PLAIN_SIGN = 2.0
"""How many times as much the wrong sign of the error must leave for the sign to be plain."""
ROWS_PER_TURN, MOST_ROWS = 128, 40_000
"""Rows an input turn that show single teeth, and how many rows there may be for their sake."""
OUTPUT_WAVES = (1, 2)
"""Waves over the output's turn that a coupling, an encoder's disc or a load that hangs on the output may add."""
FALLS = 0.9
"""Part of what the model leaves that may be left beside those waves for a fit with them: less is no reason for one."""
MEETS_AGAIN = 0.8
"""Share of the stretches that a pass back, or another recording, must reach over to have met them too."""
HARMONICS = "harmonics"
TEETH = "model, teeth and harmonics"
BOTH_WAYS = "stretches of either direction"
STRETCHES = "stretches of the one output turn"


def neighbours_of(recordings: Sequence[Recording]) -> int:
    """How many neighbouring samples of these `recordings` make a row: fewer than elsewhere, where a record of no more
    than `MOST_ROWS` rows can so show single teeth; none are averaged where it shows the teeth's mesh."""
    samples = sum(len(recording) for recording in recordings)
    turns = sum(recorded_turns(recording) for recording in recordings)
    usual = neighbours_for(recordings)
    if samples <= MOST_ROWS and samples > turns * ROWS_PER_TOOTH * mesh_order(recordings[0].ratio):
        return 1
    fewer = max(1, min(usual, int(samples / max(turns, 1.0) / ROWS_PER_TURN)))
    return fewer if samples / fewer <= MOST_ROWS else usual


def folds(rows: Rows) -> tuple[Index, str]:
    """The part (n,) that each of `rows` belongs to, and what the parts are: recordings, output turns, passes, or
    stretches, of either direction by itself where the record comes back."""
    if rows.records >= 2:
        return np.asarray(rows.record % max(FOLDS, 2), np.int64), "recordings"
    beat = np.floor((rows.theta - rows.theta.min()) / (TURN * rows.ratio)).astype(np.int64)
    if beat.max() >= 1 and (beat == 1).sum() > 0.5 * (beat == 0).sum():
        return np.asarray(beat % FOLDS, np.int64), "output turns"
    passes = np.r_[0, np.cumsum(np.diff(rows.direction) != 0)]
    if passes.max() >= 3:
        # By length, so that no part holds all that reaches round the output.
        rank = np.argsort(np.argsort(-np.bincount(passes), kind="stable"), kind="stable")
        return np.asarray(rank[passes] % FOLDS, np.int64), "reversals"
    order = (rows.theta - rows.theta.min()) / max(float(np.ptp(rows.theta)), 1e-9)
    pieces = FOLDS * PIECES
    piece = np.minimum((order * pieces).astype(int), pieces - 1)
    back = rows.direction < 0
    if all((np.bincount(piece[way], minlength=pieces) > 0).mean() > MEETS_AGAIN for way in (back, ~back)):
        # What is held out on the way there is met on the way back: nothing round the splines is left to guess.
        return np.asarray((piece + FOLDS // 2 * back) % FOLDS, np.int64), BOTH_WAYS
    return np.asarray(piece % FOLDS, np.int64), STRETCHES


def met_elsewhere(rows: Rows) -> Mask:
    """Which of the `rows` (n,) are of a recording whose input turns of the beat other recordings turned over too."""
    turn = np.floor(np.mod(rows.theta / TURN, rows.ratio))
    met = np.zeros(len(rows), np.bool_)
    for record in range(rows.records):
        mine = rows.record == record
        met[mine] = np.isin(turn[mine], turn[~mine]).mean() > MEETS_AGAIN
    return met


def tried(
    split: tuple[Rows, Index],
    terms: int | None,
    paths: Paths,
    fit: Callable[[Rows], WaveformFit | None],
    samples: Samples,
) -> dict[str, Array]:
    """What each way leaves (N,) arcmin of the `samples` of every part, fitted to the rows of the others; `split` is
    these rows (n,) and the part of each.

    Where the others show no damaged tooth, the way that has one leaves what `TEETH` does.

    `terms`, `paths` as for `candidates`; `fit` gives the model fitted to some rows, None for harmonics alone.
    """
    rows, fold = split
    each, part = samples.each, fold[samples.row]
    trials: dict[str, Array] = {}
    for k in range(int(fold.max()) + 1):
        train, test = part_of(rows, fold != k), part == k
        for name, (found, _) in candidates(train, fit(train), terms, some_of(paths, fold != k)).items():
            left = trials.setdefault(name, np.full(len(each), np.nan))
            left[test] = each.error[test] - said_of(found, each, test)
    for name, left in trials.items():
        trials[name] = np.where(np.isnan(left), trials[TEETH], left) if np.isnan(left).any() else left
    return {name: centred(left, each, part) for name, left in trials.items()}


def model_of(rows: Rows, drive: Drive, seed: int, sign: float | None = None) -> WaveformFit:
    """The model of `drive` fitted to `rows` from `seed`, with the error's `sign`; None for the one that fits better.

    What stands on the splines may be as large as the drive's own errors and make the wrong sign fit better without it:
    where neither leaves far more than the other, the signs are compared with its waves.

    Where what it leaves falls beside waves over the output's turn, it is fitted once more with them free: such a wave
    of a coupling or an encoder draws the drive's errors to itself. What the drive itself makes of them stays in it.
    """
    some = rows.rows(np.arange(0, len(rows), -(-len(rows) // FIT_ROWS)))
    plain = _signed(some, drive, seed, sign, None)
    if some.span_turns < LEAST_TURNS * some.ratio:
        return plain
    phases = np.outer(some.theta / some.ratio, OUTPUT_WAVES)
    waves = np.hstack([np.cos(phases), np.sin(phases)])
    if not _falls(some, waves, some.error - plain.predict(some.theta)):
        return plain
    beside = _signed(some, drive, seed, sign, waves)
    return beside if beside.rms_arcmin < FALLS * plain.rms_arcmin else plain


def _falls(rows: Rows, waves: Array, left: Array) -> bool:
    """Whether what the model has `left` (n,) of `rows` falls beside columns of `waves` (n, q)."""
    columns = offset_columns(rows)
    both = columns, np.column_stack([columns, waves])
    before, after = (float(np.std(left - one @ np.linalg.lstsq(one, left, rcond=1e-8)[0])) for one in both)
    return after < FALLS * before


def _signed(rows: Rows, drive: Drive, seed: int, sign: float | None, waves: Array | None) -> WaveformFit:
    """`model_of` for all `rows`, beside `waves` (n, q), if any."""
    if sign is not None:
        return fit_rows(rows, drive, seed, (sign,), waves)
    each = (fit_rows(rows, drive, seed, (s,), waves) for s in (1.0, -1.0))
    first, second = sorted(each, key=lambda fit: fit.rms_arcmin)
    if second.rms_arcmin > PLAIN_SIGN * first.rms_arcmin:
        return first
    columns = offset_columns(rows) if waves is None else np.column_stack([offset_columns(rows), waves])
    return min((first, second), key=lambda fit: _left_with_teeth(rows, columns, fit))


def _left_with_teeth(rows: Rows, free: Array, fit: WaveformFit) -> float:
    """Rms (arcmin) that a `fit` leaves in `rows` beside `free` columns (n, q), with waves on both splines."""
    found = fit_teeth(rows, free, Teeth.bare(fit.model, fit.errors, fit.sign), np.diag(fit.covariance))
    left = rows.error - found.at(rows.theta)
    return float(np.std(left - free @ np.linalg.lstsq(free, left, rcond=1e-8)[0]))


def part_of(rows: Rows, mask: Mask) -> Rows:
    """Those of `rows` in `mask` (n,), their recordings numbered anew."""
    part = rows.rows(mask)
    return replace(part, record=np.unique(part.record, return_inverse=True)[1])


def candidates(
    rows: Rows, fit: WaveformFit | None, terms: int | None, paths: Paths
) -> dict[str, tuple[Angular, float]]:
    """Every way to compensate, fitted to `rows`, in the form that will be written, and how far that form is off what
    was fitted (arcmin, peak-to-peak).

    `fit` is the model fitted to them, None for harmonics alone; `terms` coefficients at most, 0 a table, None what is
    needed; `paths` are those that the return error may take along the rows.
    """
    angles = (rows.theta, rows.theta / rows.ratio)
    zeros = (rows.record[:, None] == np.arange(rows.records)).astype(float)
    if rows.span_turns >= 0.5 * rows.ratio and not paths:
        # A drift in time; what comes again on the way back is no drift.
        zeros = np.column_stack([zeros, (rows.theta - rows.theta.mean()) / TURN])
    pairs = dictionary(rows.span_turns / rows.ratio)
    most = terms or MOST_TERMS
    alone = pursue(angles, rows.error, zeros, paths.get(AT_ONCE), pairs, most)
    lefts = [rows.error - alone.at(*angles)]
    if fit is not None:
        lefts.append(rows.error - fit.predict(rows.theta))
    crossing = _crossing(min(lefts, key=lambda left: float(np.std(left))), zeros, paths)
    path = paths.get(crossing)
    if crossing != AT_ONCE:
        alone = replace(pursue(angles, rows.error, zeros, path, pairs, most), crossing=crossing)
    count, width = round(rows.averaged), TURN / rows.rows_per_turn
    alone = alone.sharpened(rows.ratio, width, count)
    held, lost = alone.for_table(COARSE)
    table = surface_of([held], None, alone.back, crossing)
    made: dict[str, tuple[Angular, float]] = {HARMONICS: (table, lost.reach) if terms == 0 else (alone, 0.0)}
    if fit is None:
        return made
    free = zeros if path is None else np.column_stack([zeros, path])
    bare = Teeth.bare(fit.model, fit.errors, fit.sign)
    teeth = fit_teeth(rows, free, bare, np.diag(fit.covariance))
    for name, one in {"model": bare, "model and harmonics": bare, TEETH: teeth}.items():
        left = rows.error - one.at(rows.theta)
        rest = nothing(0.0 if path is None else half_return(left, zeros, path))
        if name != "model":
            rest = pursue(angles, left, zeros, path, pairs, most // 2)
        rest = replace(rest, crossing=crossing)
        spread = float(np.ptp(left - rest.at(*angles)))
        rest = rest.sharpened(rows.ratio, width, count)
        made[name] = formed(one.sharpened(width, count), rest, terms, spread)
    damaged = fit_damage(rows, free, bare, teeth)
    if damaged is not None:
        under, damage = damaged
        left = rows.error - damage.on(under, width if count > 1 else 0.0).at(rows.theta)
        rest = replace(pursue(angles, left, zeros, path, pairs, most // 2), crossing=crossing)
        spread = float(np.ptp(left - rest.at(*angles)))
        rest = rest.sharpened(rows.ratio, width, count)
        made["model, a damaged tooth and harmonics"] = formed_damaged(
            under.sharpened(width, count), damage, rest, terms, spread
        )
    if shows_mesh(rows):
        mesh = fit_mesh(rows, free, bare)
        left = rows.error - mesh.at(rows.theta)
        rest = replace(pursue(angles, left, zeros, path, pairs, most // 2), crossing=crossing)
        spread = float(np.ptp(left - rest.at(*angles)))
        made["model, teeth, their mesh and harmonics"] = formed_mesh(mesh, rest, terms, spread, rows.ratio)
    return made


def _crossing(left: Array, zeros: Array, paths: Paths) -> Crossing:
    """How the return error in what is `left` crosses after a reversal."""
    if not paths:
        return AT_ONCE
    columns = np.column_stack([zeros, paths[AT_ONCE]])
    rest = left - columns @ np.linalg.lstsq(columns, left, rcond=1e-8)[0]
    return crossing_of(left, zeros, paths, independent_share(rest))


def said_of(found: Found, each: Rows, some: Mask | None = None) -> Array:
    """What `found` says (arcmin) of `some` of the rows `each`, (n,) of one sample each, or of all: the path since a
    reversal needs those before."""
    path = path_of(each, found.crossing)
    mine = slice(None) if some is None else some
    theta = each.theta[mine]
    if isinstance(found, OfSpeed):
        return found.at(theta, theta / each.ratio, path[mine], signed_rpm(each)[mine])
    return np.asarray(found.at(theta, theta / each.ratio, path[mine]), float)


def centred(values: Array, rows: Rows, fold: Index) -> Array:
    """`values` (n,) less the mean of their recording of `rows` within their `fold` (n,): a zero is nobody's error."""
    key = rows.record * (int(fold.max()) + 1) + fold
    _, inverse = np.unique(key, return_inverse=True)
    return np.asarray(values - (np.bincount(inverse, values) / np.bincount(inverse))[inverse], float)


def choose(trials: dict[str, Array], fold: Index) -> tuple[Array, str]:
    """What of `trials`, (n,) each, is left where each part of `fold` (n,) is scored by the choice of the others, and
    the choice of all parts."""
    names = list(trials)
    squares = np.array([[float(np.sum(trials[n][fold == k] ** 2)) for k in range(int(fold.max()) + 1)] for n in names])
    nested = np.empty(len(fold))
    for k in range(squares.shape[1]):
        others = np.delete(squares, k, axis=1).sum(axis=1)
        nested[fold == k] = trials[names[int(np.argmin(others))]][fold == k]
    return nested, names[int(np.argmin(squares.sum(axis=1)))]
