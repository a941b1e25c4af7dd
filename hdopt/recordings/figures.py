"""What an acceptance sheet says of a waveform: peak-to-peak turn by turn, return error, repeatability, slope, drift.

All take the error averaged over even cells of the input angle (`Cells`), so that neither the sampling rate nor single
readings decide; each figure's uncertainty comes from the scatter within the cells and from the encoders.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.recordings.passes import find_passes
from hdopt.recordings.recording import OF_ROUNDING, TURN, Recording
from hdopt.recordings.rows import recorded_turns

CELLS_PER_TURN = 180
"""Cells an input turn: 2 deg, finer than the width of one tooth (2.2 deg for 162 teeth)."""
FEWEST_CELLS = 40
"""Cells an input turn at least where there are samples for them: the mean over 9 deg dims order 5 by 3 %."""
SAMPLES_PER_CELL = 3
"""Samples that a cell should hold, so that single readings do not make the extremes."""
COVERED = 0.9
"""A turn counts where at least this share of its cells holds samples."""
SLOPE_WINDOW_DEG = 10.0
"""Input angle over which a slope is fitted: shorter ones measure noise."""
SLIP_CELLS = 12
"""Cells before and after a place whose medians must differ for counts to have slipped there."""


@dataclass(frozen=True)
class Cells:
    """The error in even cells of the input angle, pass by pass; every array (n,).

    `angle` rad (mean of its samples), `error` arcmin, `sigma` its standard uncertainty from the scatter in the cell and
    the encoder's step, `direction` +1/-1, `pass_index` the pass, `place` the cell's number on the common grid; `width`
    rad; `noise_arcmin` the scatter of single samples.
    """

    angle: Array
    error: Array
    sigma: Array
    direction: Array
    pass_index: Index
    place: Index
    width: float
    noise_arcmin: float


@dataclass(frozen=True)
class Return:
    """Return error: error forward less error backward at the same angle; arcmin. `curve` (n,) at `angle` (n,) rad."""

    median: float
    largest: float
    sigma: float
    angle: Array
    curve: Array


def cells_of(recording: Recording, per_turn: int = CELLS_PER_TURN) -> Cells:
    """The cells of one `recording`, at most `per_turn` of them an input turn, fewer where samples are sparse."""
    passes = find_passes(recording.input_angle)
    samples = len(recording) / max(recorded_turns(recording), 1e-9)
    per_turn = max(8, int(min(per_turn, samples, max(samples / SAMPLES_PER_CELL, FEWEST_CELLS))))
    width = TURN / per_turn
    place = np.floor(recording.input_angle / width).astype(np.int64)
    change = np.flatnonzero((np.diff(place) != 0) | (np.diff(passes.index) != 0)) + 1
    starts = np.r_[0, change]
    count = np.diff(np.r_[starts, len(place)]).astype(float)
    error = np.add.reduceat(recording.error_arcmin, starts) / count
    noise = neighbour_noise(recording.error_arcmin)
    step = recording.quantum_arcmin * OF_ROUNDING
    sigma = np.sqrt((noise**2 + step**2) / count)
    return Cells(
        np.asarray(np.add.reduceat(recording.input_angle, starts) / count, float),
        np.asarray(error, float),
        np.asarray(sigma),
        passes.direction[starts],
        passes.index[starts],
        place[starts],
        width,
        noise,
    )


def neighbour_noise(error: Array) -> float:
    """Standard deviation of one sample of `error` (n,) as its second differences show it (robust; Rousseeuw's MAD)."""
    if len(error) < 5:
        return 0.0
    return float(1.4826 * np.median(np.abs(np.diff(error, 2))) / math.sqrt(6))


def turn_peak_to_peaks(cells: Cells) -> tuple[Array, Array]:
    """Peak-to-peak (arcmin) of every whole input turn of every pass, and the angle (rad) at its middle.

    A turn begins where its pass does, from the lower angle; `cells` of it must be covered to nine tenths.
    """
    per_turn = round(TURN / cells.width)
    found: list[float] = []
    middle: list[float] = []
    for index in np.unique(cells.pass_index):
        rows = np.flatnonzero(cells.pass_index == index)
        turn = (cells.place[rows] - cells.place[rows].min()) // per_turn
        for k in np.unique(turn):
            part = rows[turn == k]
            if len(part) >= COVERED * per_turn:
                found.append(float(np.ptp(cells.error[part])))
                middle.append(float(np.median(cells.angle[part])))
    return np.array(found), np.array(middle)


def directional_peak_to_peak(cells: Cells) -> float:
    """Peak-to-peak (arcmin) of all `cells`, of each direction by itself, the larger: play between them is no part."""
    return max(float(np.ptp(cells.error[cells.direction == d])) for d in np.unique(cells.direction))


def rms(cells: Cells) -> float:
    """Rms (arcmin) of the error in `cells` about the mean of each direction."""
    left = cells.error.copy()
    for direction in np.unique(cells.direction):
        rows = cells.direction == direction
        left[rows] -= left[rows].mean()
    return float(np.sqrt(np.mean(left**2)))


def return_error(cells: Cells) -> Return | None:
    """Return error on the grid of `cells` that both directions passed; None where there are none."""
    means = {}
    for direction in (1.0, -1.0):
        rows = cells.direction == direction
        if not rows.any():
            return None
        place, inverse = np.unique(cells.place[rows], return_inverse=True)
        count = np.bincount(inverse)
        means[direction] = (place, np.bincount(inverse, cells.error[rows]) / count)
    place, forward, backward = np.intersect1d(means[1.0][0], means[-1.0][0], return_indices=True)
    if len(place) < 10:
        return None
    curve = np.asarray(means[1.0][1][forward] - means[-1.0][1][backward])
    sigma = float(np.median(cells.sigma)) * math.sqrt(2)
    largest = float(curve[np.argmax(np.abs(curve))])
    return Return(float(np.median(curve)), largest, sigma, (place + 0.5) * cells.width, curve)


def repeatability(parts: Sequence[Cells]) -> float | None:
    """Standard deviation (arcmin) of the error at one input angle and direction, over repeated passes.

    `parts` are the cells of one recording, or of several whose counts share a zero. A pass's own mean is taken out, so
    a zero that was set anew does not count. None where no stretch of a turn was passed twice in one direction: the
    error repeats only after a whole output turn, so neighbouring turns are not repetitions.
    """
    curves: dict[float, list[tuple[Index, Array]]] = {1.0: [], -1.0: []}
    for cells in parts:
        for index in np.unique(cells.pass_index):
            rows = cells.pass_index == index
            order = np.argsort(cells.place[rows])
            curves[float(cells.direction[rows][0])].append((cells.place[rows][order], cells.error[rows][order]))
    squares, freedom = 0.0, 0
    fewest = round(TURN / parts[0].width)
    for passes in curves.values():
        for k, (place, error) in enumerate(passes):
            for other_place, other_error in passes[k + 1 :]:
                _, one, two = np.intersect1d(place, other_place, return_indices=True)
                if len(one) >= fewest:
                    off = error[one] - other_error[two]
                    squares += float(((off - off.mean()) ** 2).sum()) / 2
                    freedom += len(off)
    return math.sqrt(squares / freedom) if freedom else None


def steepest_slope(cells: Cells) -> tuple[float, float] | None:
    """Steepest slope of the error against the input angle, arcmin per deg, and its standard uncertainty.

    A straight line over `SLOPE_WINDOW_DEG` of neighbouring `cells` of one pass; None where no pass has as many without
    a gap.
    """
    half = max(2, round(math.radians(SLOPE_WINDOW_DEG) / cells.width / 2))
    ones = np.ones(2 * half + 1)
    found: list[tuple[float, float]] = []
    for index in np.unique(cells.pass_index):
        rows = np.flatnonzero(cells.pass_index == index)
        rows = rows[np.argsort(cells.place[rows])]
        place, error = cells.place[rows], cells.error[rows]
        if len(rows) <= 2 * half:
            continue
        angle = np.degrees(cells.angle[rows] - cells.angle[rows].mean())
        sums = [np.convolve(v, ones, "valid") for v in (angle, error, angle * error, angle**2)]
        spread = sums[3] - sums[0] ** 2 / len(ones)
        slope = np.abs((sums[2] - sums[0] * sums[1] / len(ones)) / spread)
        whole = place[2 * half :] - place[: -2 * half] == 2 * half
        if whole.any():
            found.append((float(slope[whole].max()), float(np.median(cells.sigma) / np.sqrt(np.median(spread)))))
    return max(found, default=None)


def drift(cells: Cells) -> float:
    """Straight line through the error of `cells` in the order recorded, arcmin from begin to end, direction apart."""
    along = np.linspace(-0.5, 0.5, len(cells.error))
    columns = np.column_stack([along, np.ones(len(along)), cells.direction * (np.ptp(cells.direction) > 0)])
    return float(np.linalg.lstsq(columns, cells.error, rcond=None)[0][0])


def slips(cells: Cells, quantum_arcmin: float) -> list[tuple[float, float]]:
    """Places (rad) where the error of `cells` steps and stays, and by how much (arcmin): counts that slipped.

    A step counts above eight times the scatter about both sides' straight lines, and above twice the encoder's step
    `quantum_arcmin`; steps of one encoder step or less cannot be told. One that lies within a cell shows on both of its
    sides, and counts once, at the larger.
    """
    n = SLIP_CELLS
    found: list[tuple[float, float]] = []
    for index in np.unique(cells.pass_index):
        rows = np.flatnonzero(cells.pass_index == index)
        error = cells.error[rows]
        if len(error) < 4 * n:
            continue
        jump = np.diff(error)
        usual = 1.4826 * float(np.median(np.abs(jump - np.median(jump)))) + 1e-12
        for k in np.flatnonzero(np.abs(jump) > max(10 * usual, 2 * quantum_arcmin, 0.05)):
            if n <= k < len(error) - n and abs(jump[k - 1]) < abs(jump[k]) >= abs(jump[k + 1]):
                before, after = error[k - n + 1 : k + 1], error[k + 1 : k + 1 + n]
                if abs(float(np.median(after) - np.median(before))) > 0.6 * abs(jump[k]):
                    found.append((float(cells.angle[rows][k]), _height(error, int(k))))
    return found


def _height(error: Array, k: int) -> float:
    """Height of a step between cells k and k + 1, from straight lines through four cells on either side, the two next
    to it left out because the step may lie within them."""
    at = np.arange(4)
    left, right = np.polyfit(at - 4.5, error[k - 4 : k], 1), np.polyfit(at + 1.5, error[k + 2 : k + 6], 1)
    return float(right[1] - left[1])


def skew_s(recording: Recording) -> tuple[float, float] | None:
    """Delay of the output channel behind the input, s, and its standard uncertainty, from passes at several speeds.

    The error of a delayed output grows by delay x speed/N. Play between directions does the same for one speed, so at
    least two speeds (a tenth apart) in one direction of `recording` are needed; None otherwise.
    """
    if recording.time is None or recording.input_locked:
        return None
    passes = find_passes(recording.input_angle)
    speed = np.gradient(recording.input_angle, recording.time)
    means, speeds, directions = [], [], []
    for index in range(passes.count):
        rows = passes.index == index
        if np.ptp(recording.input_angle[rows]) < TURN:
            continue
        whole = recording.input_angle[rows] - recording.input_angle[rows].min()
        rows = np.flatnonzero(rows)[whole < TURN * math.floor(float(whole.max()) / TURN)]
        means.append(float(recording.error_arcmin[rows].mean()))
        speeds.append(float(np.median(speed[rows])))
        directions.append(float(passes.direction[rows][0]))
    size = np.abs(speeds)
    if len(means) < 4 or np.ptp(size) < 0.1 * size.max():
        return None
    scale = 10800 / math.pi / recording.ratio
    columns = np.column_stack([np.array(speeds) * scale, np.ones(len(means)), directions])
    solution = np.linalg.lstsq(columns, np.array(means), rcond=None)[0]
    left = np.array(means) - columns @ solution
    variance = float(left @ left) / max(len(means) - 3, 1)
    inverse = np.linalg.pinv(columns.T @ columns)
    return float(solution[0]), math.sqrt(max(variance * float(inverse[0, 0]), 0.0))
