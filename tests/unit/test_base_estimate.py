"""The base's errors as a drive's, their intervals and what a record leaves open, against what is worked out by hand."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.inference import base_fit
from hdopt.diagnosis.inference.base_fit import (
    base_estimate,
    beat_warning,
    beyond_tolerances,
    far_errors,
    open_combinations,
)
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict.draw import base_notes
from hdopt.parallel.engine import engine_in_force

HALF_WIDTH = 5.0
PRIOR = np.full(12, 0.05)


def fitted(errors, spread, stated=()):
    """A fit of Cartesian errors (12,) mm with these standard deviations (12,) mm; zeros have their coefficients too.
    `stated` are the tolerances of its study."""
    covariance = np.diag(np.r_[np.square(spread), 7.0])
    base = SimpleNamespace(half_width=HALF_WIDTH)
    settings = replace(DEFAULT, base=replace(DEFAULT.base, stated_tolerances=tuple(stated)))
    problem = SimpleNamespace(base=base, settings=settings, prior=PRIOR, box=np.array(DEFAULT.base.box_mm))
    return SimpleNamespace(
        problem=problem,
        errors=np.asarray(errors, float),
        covariance=lambda: covariance,
        base_value=np.array([-0.3, 0.3]),
    )


def estimated(errors, spread):
    """What `fitted` says of the drive."""
    return base_estimate(fitted(errors, spread))


SHIPPED = {
    "axis_eccentricity_mm": ((0, 1), 0.015),
    "axis_tilt_x_deg": ((2,), math.degrees(math.atan(0.047 / 3 / HALF_WIDTH))),
    "axis_tilt_y_deg": ((3,), math.degrees(math.atan(0.047 / 3 / HALF_WIDTH))),
    "wg_eccentricity_mm": ((4, 5), 0.0075),
    "wg_tilt_major_deg": ((6,), math.degrees(math.atan(0.008 / HALF_WIDTH))),
    "wg_tilt_minor_deg": ((7,), math.degrees(math.atan(0.008 / HALF_WIDTH))),
    "cs_tooth_amplitude_mm": ((8, 9), 0.003),
    "fs_tooth_amplitude_mm": ((10, 11), 0.003),
}
"""Errors with a size: their Cartesian parts, and the tolerance of csf-25-80 that a third of the bounds stands for."""


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("name", SHIPPED)
def test_what_is_surely_beyond_its_tolerance(name, sign):
    """Each error by itself at 1.5 times its tolerance, known to a twentieth of it: surely 1.4 times. Faults caught: a
    tilt of one sign, the value in place of the lower end of its interval, one part of a vector alone."""
    parts, allowed = SHIPPED[name]
    length = np.array(DEFAULT.base.box_mm)[parts[0]] / 3
    errors, spread = np.full(12, 1e-5), np.full(12, 1e-6)
    errors[list(parts)] = sign * 1.5 * length / math.sqrt(len(parts))
    spread[list(parts)] = 0.05 * length
    (found,) = beyond_tolerances(fitted(errors, spread), 1.2)
    assert (found.name, found.unit) == (name, name.rsplit("_", 1)[1])
    assert found.allowed == pytest.approx(allowed, rel=1e-3)
    assert found.size == pytest.approx(1.5 * allowed, rel=1e-3)
    assert found.times == pytest.approx(1.5 - 1.96 * 0.05, rel=2e-3)
    assert beyond_tolerances(fitted(errors, spread), 1.41) == []
    assert f"{name} {found.size:.2g}" in str(found)


@pytest.mark.parametrize(
    ("stated", "of_kind", "of_study"), [(0.002, 0.015, 0.002), (0.03, 0.03, 0.03), (None, 0.015, 0.015)]
)
def test_what_a_study_states_is_asked_of_the_drive(stated, of_kind, of_study):
    """An eccentricity just over what is allowed by the study, and by drives of its kind, which are as good as the
    shipped ones or as bad as the study lets them be. Faults caught: a study's tolerance that is not read, one that is
    tight taken for what parts can be, one that is wide ignored."""
    tolerances = () if stated is None else (("axis_eccentricity_mm", stated), ("wg_eccentricity_mm", 1e-4))
    spread = np.full(12, 1e-9)
    for asked, allowed in ((False, of_kind), (True, of_study)):
        for size, found in ((1.01, ["axis_eccentricity_mm"]), (0.99, [])):
            errors = np.full(12, 1e-6)
            errors[0] = size * allowed
            fit = fitted(errors, spread, tolerances)
            assert [one.name for one in beyond_tolerances(fit, 1.0, of_study=asked)] == found
            assert all(one.allowed == pytest.approx(allowed) for one in beyond_tolerances(fit, 1.0, of_study=asked))


def test_the_warning_says_whose_tolerances():
    errors = np.full(12, 1e-6)
    errors[0] = 0.01
    spread = np.full(12, 1e-9)
    (said,) = base_notes(fitted(errors, spread, [("axis_eccentricity_mm", 0.005)]))
    assert "outside the tolerances of its study (axis_eccentricity_mm 0.01 mm, tolerance 0.005)" in said
    assert base_notes(fitted(errors, spread, [("axis_eccentricity_mm", 0.03)])) == ()
    errors[0] = 0.02
    (said,) = base_notes(fitted(errors, spread, [("wg_eccentricity_mm", 0.03)]))
    assert "outside the tolerances of its kind (axis_eccentricity_mm 0.02 mm, tolerance 0.015)" in said


def test_the_farthest_comes_first_and_a_gear_without_a_base_has_none():
    errors = np.full(12, 1e-5)
    errors[6], errors[8] = 0.02, 0.009
    found = beyond_tolerances(fitted(errors, np.full(12, 1e-6)), 1.2)
    assert [one.name for one in found] == ["cs_tooth_amplitude_mm", "wg_tilt_major_deg"]
    bare = fitted(errors, np.full(12, 1e-6))
    bare.problem.base = None
    assert beyond_tolerances(bare, 1.2) == []


def test_far_is_over_its_prior_or_surely_twice_its_tolerance():
    errors = np.full(12, 1e-5)
    assert far_errors(fitted(errors, np.full(12, 1e-6))) == ""
    errors[6] = 1.9 * 0.008
    assert far_errors(fitted(errors, np.full(12, 1e-6))) == ""
    errors[6] = 2.1 * 0.008
    assert far_errors(fitted(errors, np.full(12, 1e-6))).startswith("wg_tilt_major_deg 0.19 deg, tolerance 0.092")
    errors[0] = 0.08
    assert far_errors(fitted(errors, np.full(12, 1e-6))) == "axis eccentricity x 0.08 mm"


def test_intervals_of_a_length_and_its_direction_are_those_of_its_two_parts():
    """An eccentricity of 0.02 mm along x (direction 90 deg): its length is as uncertain as x, and its direction lies
    between the rays that touch the ellipse of 1.96 standard deviations; lengths in mm and angles in deg."""
    spread = np.full(12, 1e-6)
    spread[:2] = 0.003, 0.001
    errors = np.full(12, 0.01)
    errors[:2] = 0.02, 0.0
    found = estimated(errors, spread).parameters
    length, direction = found["axis_eccentricity_mm"], found["axis_eccentricity_direction_deg"]
    assert (length.value, length.unit) == (pytest.approx(0.02), "mm")
    assert (length.low, length.high) == (pytest.approx(0.02 - 1.96 * 0.003), pytest.approx(0.02 + 1.96 * 0.003))
    assert (direction.value, direction.unit) == (pytest.approx(90.0), "deg")
    touching = math.atan(1.96 * 0.001 / math.sqrt(0.02**2 - (1.96 * 0.003) ** 2))
    assert (direction.low, direction.high) == pytest.approx((90 - math.degrees(touching), 90 + math.degrees(touching)))


def test_a_tilt_is_its_lift_over_half_the_width():
    spread = np.full(12, 1e-6)
    spread[2] = 0.001
    found = estimated(np.full(12, 0.01), spread).parameters["axis_tilt_x_deg"]
    assert found.value == pytest.approx(np.degrees(np.arctan(0.01 / HALF_WIDTH)))
    assert found.high - found.value == pytest.approx(np.degrees(1.96 * 0.001 / HALF_WIDTH), rel=1e-4)


PAIRS = {
    "axis_eccentricity_mm": ("axis_eccentricity_direction_deg", 1, 0),
    "wg_eccentricity_mm": ("wg_eccentricity_direction_deg", 4, 5),
    "cs_tooth_amplitude_mm": ("cs_tooth_phase_deg", 8, 9),
    "fs_tooth_amplitude_mm": ("fs_tooth_phase_deg", 10, 11),
}
"""Sizes: their angle, and the Cartesian errors along its nought and a quarter turn on."""


@pytest.mark.parametrize("name", PAIRS)
def test_a_direction_passes_the_half_turn(name):
    """Against its nought the angle jumps from 180 to -180 deg: its interval does not. Faults caught: another pair's
    errors, a pair the other way round."""
    angle, along, across = PAIRS[name]
    spread, errors = np.full(12, 1e-6), np.full(12, 0.01)
    spread[across], errors[along], errors[across] = 0.001, -0.02, 0.0
    direction = estimated(errors, spread).parameters[angle]
    assert direction.value == pytest.approx(180.0)
    assert direction.high - direction.low == pytest.approx(2 * math.degrees(math.atan(1.96 * 0.001 / 0.02)), rel=1e-6)


@pytest.mark.parametrize("size", [0.0, 1e-57, 0.02])
@pytest.mark.parametrize("name", PAIRS)
def test_what_is_not_seen_is_not_said_to_be_nought(name, size):
    """Both parts known to 0.03 mm, as of eccentricities that a structure takes away: from nought to as large as that,
    in any direction. Faults caught: an interval by the slopes of a length at nought, which are none; what rounding left
    of nought, said."""
    angle, along, across = PAIRS[name]
    spread, errors = np.full(12, 1e-6), np.full(12, 0.01)
    spread[[along, across]], errors[along], errors[across] = 0.03, size, 0.0
    found = estimated(errors, spread).parameters
    assert (found[name].low, found[name].high) == (0.0, pytest.approx(size + 1.96 * 0.03, rel=1e-6))
    assert found[name].value == (0.02 if size == 0.02 else 0.0)
    assert found[angle].undefined and found[angle].high - found[angle].low == 360.0


def test_what_is_left_open_is_a_part_of_the_prior():
    """Standard deviations of 0.05 and 0.15 of the prior: variances below and above a hundredth of its. The names are
    those of the largest members, whatever their sign."""
    names = open_combinations(np.diag([(0.05 * 0.05) ** 2] * 11 + [(0.15 * 0.05) ** 2]), PRIOR)
    assert names == ("FS tooth cosine",)
    for members in ((0.3, -0.9), (-0.3, -0.9), (0.3, 0.9), (-0.3, 0.9)):
        both = np.zeros(12)
        both[[4, 8]] = members
        (name,) = open_combinations(np.diag([(0.01 * 0.05) ** 2] * 12) + np.outer(0.05 * both, 0.05 * both), PRIOR)
        assert name == "CS tooth sine with wave-generator eccentricity along its major axis"
        both[[8, 4]] = members
        (name,) = open_combinations(np.diag([(0.01 * 0.05) ** 2] * 12) + np.outer(0.05 * both, 0.05 * both), PRIOR)
        assert name == "wave-generator eccentricity along its major axis with CS tooth sine"
    # Of three that are left open together the last is below 0.3 of the largest, and above 0.3 of the second.
    three = np.zeros(12)
    three[[4, 8, 9]] = 0.8, 0.5, 0.2
    (name,) = open_combinations(np.diag([(0.01 * 0.05) ** 2] * 12) + np.outer(0.05 * three, 0.05 * three), PRIOR)
    assert name == "wave-generator eccentricity along its major axis with CS tooth sine"
    wide = PRIOR * np.r_[20.0, np.ones(11)]
    assert open_combinations(np.diag([(0.5 * 0.05) ** 2, *[1e-12] * 11]), wide) == ()


def rows_over(turns, ratio=80.0, rate=48):
    theta = np.arange(round(turns * rate)) * 2 * np.pi / rate

    class Rows(SimpleNamespace):
        def __len__(self):
            return len(self.theta)

    return Rows(theta=theta, ratio=ratio, span_turns=turns)


def uncertainty(turns, ratio=80.0, rate=48):
    """Standard deviation of the worst combination of order 2's sine and cosine beside order 2 (1 + 1/N), at unit noise,
    by ordinary least squares."""
    theta = np.arange(round(turns * rate)) * 2 * np.pi / rate
    columns = [f(order * theta) for order in (2.0, 2.0 * (1 + 1 / ratio)) for f in (np.sin, np.cos)]
    design = np.column_stack([*columns, np.ones(len(theta))])
    return np.sqrt(np.linalg.eigvalsh(np.linalg.inv(design.T @ design)[:2, :2])[-1])


@pytest.mark.parametrize("turns", [5, 10])
def test_a_short_record_says_how_much_worse_it_tells_the_splines_apart(turns):
    """Against the covariance of least squares, of this record and of one over an output turn."""
    said = beat_warning(rows_over(turns))
    growth = float(said.split("apart ")[1].split(" times")[0])
    assert growth == pytest.approx(uncertainty(turns) / uncertainty(80), rel=0.06)  # two digits are written
    for enough in (20, 80):
        assert uncertainty(enough) / uncertainty(80) < DEFAULT.base.beat_growth
        assert beat_warning(rows_over(enough)) is None


def fit_from_starts(monkeypatch, on_thinned_rows):
    """A fit of the base whose thinned objective is `on_thinned_rows` of the first error, mm, and on all rows the less
    the farther that is from 0.03 mm; the drives that were tried."""
    tried = []

    class Problem(SimpleNamespace):
        def only(self, mask):
            return Problem(**{**vars(self), "thin": True})

    def evaluate(problem, errors, offsets, terms, coefficients):
        if problem.thin:
            tried.append(errors)
        objective = on_thinned_rows(errors[0]) if problem.thin else 2.0 - abs(errors[0] - 0.03)
        fields = {"problem": problem, "errors": errors, "offsets": offsets, "coefficients": coefficients}
        return SimpleNamespace(objective=objective, terms=terms, **fields)

    monkeypatch.setattr(base_fit, "evaluate", evaluate)
    monkeypatch.setattr(base_fit, "refine", lambda fit, *rest, **more: fit)
    monkeypatch.setattr(base_fit, "with_offsets", lambda fit: fit)
    problem = Problem(
        base="a base", thin=False, settings=DEFAULT, nuisance=np.ones((9, 1)), rows=np.zeros(9), prior=PRIOR
    )
    with engine_in_force("process"):  # so that drives are listed in the order in which they are drawn
        return base_fit.fit_base(problem, np.random.default_rng(1), starts=16), np.array(tried)


@pytest.fixture
def started(monkeypatch):
    """Of objectives on thinned rows that are least at a first error of 0.03 mm: all rows say the contrary."""
    return fit_from_starts(monkeypatch, lambda error: 1.0 + abs(error - 0.03))


@pytest.mark.parametrize(("met", "starts"), [(8, 8), (4, 8), (3, 9), (1, 16)])
def test_starts_end_where_enough_of_them_have_met(monkeypatch, met, starts):
    """So many (`met`) of the first eight in one minimum, and the ninth; of the others none. Faults caught: starts that
    go on after the fourth, or end before."""
    numbers = iter(range(16))

    def objective(error):
        number = next(numbers)
        alike = number < met or (number == 8 and met == 3)
        return 1.0 if alike else 2.0 + number

    _, tried = fit_from_starts(monkeypatch, objective)
    assert len(tried) == starts


def test_the_best_of_the_drives_kept_is_the_best_on_all_rows(started):
    """Of the two that are best on thinned rows. Fault caught: the first of them kept, whatever all rows say."""
    fit, tried = started
    kept = sorted(tried[:, 0], key=lambda error: abs(error - 0.03))[: DEFAULT.base.kept_starts]
    assert fit.errors[0] == kept[-1] != kept[0]


def test_starts_are_random_drives_of_sizes_below_the_prior(started):
    """No two alike, of either sign, within the largest share of the prior that a start may have (five sigma)."""
    _, tried = started
    assert len(np.unique(tried)) == tried.size
    assert 0.3 < np.mean(tried > 0) < 0.7
    assert np.abs(tried / PRIOR).max() < 5 * DEFAULT.base.largest_start
    assert np.std(tried / PRIOR) > DEFAULT.base.smallest_start


def test_the_base_has_the_scatter_of_its_error():
    """Of an error of 0.3 to either side; without a base there is none."""
    assert estimated(np.zeros(12), np.full(12, 0.001)).rms_arcmin == pytest.approx(0.3)
    bare = fitted(np.zeros(12), np.full(12, 0.001))
    bare.problem.base = None
    assert base_estimate(bare).rms_arcmin == 0.0
