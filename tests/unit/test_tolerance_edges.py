"""Stacks at the edges of what a study may say: directions left out, no bounds, tilts beyond the closed form."""

import json

import numpy as np
import pytest

from hdopt.drive.errors import PHASE_OF, STUDY_KEYS, study_key
from hdopt.errors import HdoptError
from hdopt.study import load_study
from hdopt.tolerance.distributions import Fixed, Rayleigh, Uniform
from hdopt.tolerance.drive_inputs import drive_problem, with_free_directions
from hdopt.workflow.stack import stack, study_problem

DIRECTIONS = [key for key in STUDY_KEYS if key.endswith(("direction_deg", "phase_deg"))]


def shipped_without(keys):
    """The shipped drive whose [tolerances] leave out `keys`."""
    study = load_study("csf-25-80")
    rows = {key: row for key, row in study.data["tolerances"].items() if key not in keys}
    return study.with_({"tolerances": rows})


def test_directions_that_are_left_out_are_free():
    full = stack("csf-25-80", n=2**13, seed=3)
    left_out = stack(shipped_without(DIRECTIONS), n=2**13, seed=3)
    # the shipped tolerances give every direction over the full turn: the very same sample
    assert left_out.stack.to_dict() == full.stack.to_dict()
    assert "free over the full turn" in left_out.notes[0] and all(key in left_out.notes[0] for key in DIRECTIONS)
    assert not any("free over" in note for note in full.notes)


def test_a_direction_that_is_said_stays_as_it_is():
    study = shipped_without(["axis_eccentricity_direction_deg"]).with_(
        {"tolerances.axis_eccentricity_direction_deg": {"distribution": "fixed", "value": 30.0}}
    )
    problem = study_problem(study)
    inputs = problem.space.sample(np.random.default_rng(0).random((50, problem.space.dimension)))
    assert problem.response.errors(inputs).axis_eccentricity_direction == pytest.approx(np.radians(30.0))
    assert not any("axis_eccentricity_direction_deg" in note for note in problem.notes)


def test_only_magnitudes_that_vary_get_a_direction():
    made, freed = with_free_directions({"wg_tilt_major_deg": Uniform(lower=-0.1, upper=0.1)})
    assert list(made) == ["wg_tilt_major_deg"] and freed == ()
    given = {"cs_tooth_amplitude_mm": Rayleigh(scale=0.001), "cs_tooth_phase_deg": Fixed(value=0.0)}
    assert with_free_directions(given) == (given, ())
    problem = drive_problem(load_study("csf-25-80").drive, {"fs_tooth_amplitude_mm": Rayleigh(scale=0.001)})
    assert problem.space.names == ("fs_tooth_amplitude_mm", "fs_tooth_phase_deg")
    assert problem.freed == ("fs_tooth_phase_deg",)
    assert problem.space.turning == {"fs_tooth_phase_deg"}


def test_without_bounds_the_worst_case_is_left_out_with_a_word():
    study = load_study("csf-25-80").with_({"tolerances.axis_tilt_y_deg": {"distribution": "normal", "std": 0.05}})
    result = stack(study, n=2**13, worst_case=True)
    assert result.worst_case is None
    assert [note for note in result.notes if "worst case is left out" in note and "axis_tilt_y_deg" in note]
    assert json.dumps(result.to_dict())


@pytest.mark.parametrize("homogenization", ["single_tooth", "contact"])
def test_tilts_beyond_the_closed_form_have_no_proven_bound(homogenization):
    wide = {"distribution": "uniform", "lower": -5.0, "upper": 5.0}
    study = load_study("csf-25-80").with_(
        {"tolerances.axis_tilt_y_deg": wide, "width_mm": 1.0, "requirement.homogenization": homogenization}
    )
    problem = study_problem(study)
    assert problem.response.upper_bound(*problem.space.box) is None
    # a tail needs the bound as well: it goes on without one
    result = stack(study, n=2**13, tail=0.5)
    assert 0 < result.tail.low <= result.tail.probability <= result.tail.high < 1


def test_no_flank_carries_where_none_runs_free():
    import math

    from hdopt.mechanics.contact import FLANKS, Contact
    from hdopt.mechanics.tooth_path import Mesh

    own = load_study("csf-25-80").drive
    mesh = Mesh(own.geometry, own.wave_generator.profile)
    none, some = (Contact(mesh.geometry, angle, mesh.summed_depth(angle), FLANKS) for angle in (0.0, 0.5))
    assert none.flank_pressure(1000.0, 9.0) == math.inf
    assert 0 < some.flank_pressure(1000.0, 9.0) < math.inf


def test_a_search_with_zero_backlash_has_an_answer():
    from hdopt.workflow.search import search

    study = load_study("csf-25-80-design-trade").with_(
        {
            "clearances.backlash_mm": 0.0,
            "search.profiles": ["ellipse"],
            "search.structures": ["integral"],
            "search.objective": "peak_to_peak_arcmin",
            "search.robust": False,
        }
    )
    found = search(study, fronts=False)
    # below a ratio of 1 no flank runs free without backlash, far above it the trailing flank has no room
    assert found.feasible and 1.0 - 1e-3 < found.best.variables["deflection_ratio"] < 1.1
    assert found.best.quantities["trailing_flank_room_mm"] > -1e-6
    assert 0 < found.best.quantities["flank_pressure_mpa"] < float("inf")


@pytest.mark.parametrize("key", [key for key in STUDY_KEYS if key not in map(study_key, PHASE_OF.values())])
def test_no_tolerance_reaches_beyond_what_an_error_may_be(key):
    """Tilts of 95 deg were drawn, and gave 1e16 arcmin."""
    largest = 5.0
    for upper, allowed in ((largest, True), (1.1 * largest, False)):
        tolerance = f'tolerances.{key}={{distribution="uniform", lower=0.0, upper={upper}}}'
        if allowed:
            study_problem(load_study("csf-25-80", [tolerance]))
            load_study("csf-25-80", [f"errors.{key}={upper}"]).errors  # noqa: B018
            continue
        with pytest.raises(HdoptError, match=rf"^--set tolerances\.{key}: .*at most 5 (deg|mm) can be computed"):
            study_problem(load_study("csf-25-80", [tolerance]))
        with pytest.raises(HdoptError, match="less than or equal to 5"):
            load_study("csf-25-80", [f"errors.{key}={upper}"])
