"""What a diagnosis says of each effect that it fitted: over all of them, the numbers that a study would give."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_effect_physics import GEAR, RATIO, moving

from hdopt.effects import EFFECTS, catalogue
from hdopt.effects.base import Effect
from hdopt.effects.declared import Quantity, Sines
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.term import Term
from hdopt.effects.tooth_mesh import SIDEBANDS, ZONE_SIDEBANDS
from hdopt.errors import HdoptError

LONG = moving((14, 14, 14))
RECORD = replace(LONG, torque=4 * LONG.known_torque)
"""Long and loaded enough for each example: up to 80 Nm."""
KEYS_OF = {
    "stiffness_1": "stiffness_1_nm_per_rad",
    "stiffness_2": "stiffness_2_nm_per_rad",
    "stiffness_3": "stiffness_3_nm_per_rad",
    "knee_1": "knee_1_nm",
    "knee_2": "knee_2_nm",
    "hardening": "hardening_torque_nm",
    "unequal_um": "unequal_2_um",
    "height_half_a_turn_on_arcmin": "height_2_arcmin",
}
"""Names in a diagnosis that differ from the keys of a study."""


NO_PHASE = ("bearing_pass", "lost_motion", "torsional_windup", "tooth_mesh")
"""Of their sines the size is said: their phase is of a cage or of where a recording began, or they are many."""


def values_of(effect, example):
    """Shape and coefficients of an `example`; None where it is of a drive of other teeth."""
    defaults = {i.key: i.default for i in effect.flat_declared() if isinstance(i.default, (str, float, int))}
    try:
        return effect.values({**defaults, **example}, GEAR)
    except HdoptError as refused:
        assert "teeth" in str(refused)
        return None


SAID = [
    pytest.param(effect, example, values_of(effect, example), id=f"{effect.id}-{number}")
    for effect in EFFECTS.values()
    for number, example in enumerate(effect.examples)
    if values_of(effect, example) is not None
]


def fitted(effect, shape, coefficients, share=0.01):
    """The term at a shape, and an estimate of it that is right, with standard deviations of a `share` of each."""
    term = effect.term(RECORD, shape, np.zeros(len(RECORD)))
    start = np.zeros(term.width)  # what is unknown at the start of a recording stands behind, and is nothing
    start[: len(coefficients)] = coefficients
    values = np.r_[start, [float(term.shape[key]) for key in term.steps]]
    return term, FitEstimate(values, np.diag((share * np.abs(values) + 1e-9) ** 2))


@pytest.mark.parametrize(("effect", "example", "values"), SAID)
def test_a_diagnosis_says_the_numbers_that_a_study_would_give(effect, example, values):
    """Would catch a number of another coefficient, a sine without its phase, a scale or a unit that is not its own."""
    term, estimate = fitted(effect, *values)
    said = effect.parameters(term, estimate)
    units = {one.key: one.unit for one in effect.flat_declared() if isinstance(one, Quantity)}
    named = {KEYS_OF.get(name, name): parameter for name, parameter in said.items()}
    known = {key: parameter for key, parameter in named.items() if key in example}
    assert known
    for key, parameter in known.items():
        if key.endswith("_nm_per_rad"):
            assert abs(parameter.value) == pytest.approx(abs(example[key]), rel=1e-6)
        else:
            assert parameter.value == pytest.approx(example[key], rel=1e-6), key
        assert parameter.unit == units[key]
        assert parameter.low <= parameter.value <= parameter.high
    # Of sines that are said one by one each has both of its numbers.
    for one in effect.declared:
        if isinstance(one, Sines):
            phases = [phase for size, phase in one.members.values() if size in known]
            assert effect.id in NO_PHASE or set(phases) <= set(said)


@pytest.mark.parametrize(("effect", "example", "values"), SAID)
def test_an_interval_is_as_wide_as_the_estimate_is_uncertain(effect, example, values):
    """Twice the standard deviations make intervals about twice as wide, up to what is known from zero on. Would catch
    an interval of another number, or none."""
    once, twice = (
        effect.parameters(term, estimate)
        for term, estimate in (fitted(effect, *values, share) for share in (1e-3, 2e-3))
    )
    for name, one in once.items():
        if one.high > one.low and abs(one.value) > 1e-6 and name != "lines":  # a whole number, half to either side
            assert (twice[name].high - twice[name].low) / (one.high - one.low) == pytest.approx(2, rel=0.02), name


def test_places_in_the_catalogue_leave_room_between():
    """Ten apart at least, none twice: an effect that is dropped in can stand anywhere."""
    places = [effect.place for effect in EFFECTS.values()]
    assert places == sorted(places)
    assert all(place % 10 == 0 for place in places) and len(set(places)) == len(places)


MODULE = """
from abc import abstractmethod
from hdopt.effects.base import Effect
from hdopt.effects.channel_delay import ChannelDelay

class Half(Effect):
    id = "half"
    @abstractmethod
    def other_half(self): ...

class NoName(Effect):
    domain = "time"

class Whole(Half):
    id = "whole"
    def other_half(self): ...
"""


def test_a_module_holds_the_effects_that_it_defines_whole(tmp_path, monkeypatch):
    """Would catch an effect that is only imported, one without an id and one that is not finished, counted."""
    (tmp_path / "held_for_a_test.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert [effect.id for effect in catalogue._effects_in("held_for_a_test")] == ["whole"]


def test_waves_of_the_flexsplines_teeth_pass_one_more_in_n():
    """Its teeth advance by 1 + 1/N of a turn of the input (two teeth of 2 N)."""
    shape, _ = EFFECTS["fs_tooth_harmonics"].values({"amplitude_3_um": 1.0, "phase_3_deg": 0.0}, GEAR)
    assert EFFECTS["fs_tooth_harmonics"].orders(shape, RATIO) == pytest.approx([3 * (1 + 1 / RATIO)])
    assert EFFECTS["cs_tooth_harmonics"].orders(shape, RATIO) == [3.0]


def test_recordings_are_counted_by_the_last_row():
    one = moving((2,))
    assert one.records == 1
    assert replace(one, record=np.r_[np.zeros(len(one) - 1, np.int64), 1]).records == 2


# which parts show


def teeth(members, sizes):
    """A term of these harmonics of the CS teeth and pairs of these sizes, all in the cosine but the first."""
    pairs = np.array([[0.0, size] for size in sizes])
    pairs[0] = pairs[0][::-1]
    return Term("cs_tooth_harmonics", {"members": members}, columns=np.ones((3, 2 * len(members)))), pairs.ravel()


@pytest.mark.parametrize(
    ("members", "sizes", "shows"),
    [
        ((2, 5), (1.0, 0.16), True),
        ((2, 5), (1.0, 0.15), False),
        ((2, 5), (1.0, 0.14), False),
        ((2, 3, 4), (1.0, 0.1, 0.1), False),
        ((2, 3, 4), (1.0, 0.2, 0.1), True),
        ((2, 3, 4, 5), (1.0, 0.2, 0.1, 0.1), True),
        ((2, 3, 4, 5), (1.0, 0.1, 0.1, 0.1), False),
        ((2, 3, 4, 5, 6), (1.0, 0.1, 0.1, 0.1, 0.1), True),
        ((2, 3, 4, 5, 6, 7, 8), (1.0, *6 * (0.1,)), True),
    ],
)
def test_of_few_waves_of_the_teeth_all_show_and_of_a_short_run_half(members, sizes, shows):
    """What is no more than 0.15 of the largest does not show. A run of up to four waves (2 to 5) is short."""
    term, coefficients = teeth(members, sizes)
    estimate = FitEstimate(coefficients, np.eye(len(coefficients)))
    assert EFFECTS["cs_tooth_harmonics"].every_part_shows(term, estimate) is shows


def test_what_does_not_show_of_few_waves_is_left_out():
    effect = EFFECTS["cs_tooth_harmonics"]
    assert effect.trimmed(*teeth((2, 5, 9), (1.0, 0.1, 0.5))) == {"members": (2, 9)}
    assert effect.trimmed(*teeth((2, 5, 9), (0.1, 1.0, 0.5))) == {"members": (5, 9)}
    assert effect.trimmed(*teeth((2, 5), (1.0, 0.2))) is None
    assert effect.trimmed(*teeth((2, 3), (1.0, 0.1))) is None  # a run without a gap is shortened instead


@pytest.mark.parametrize(("first", "shows"), [(0.35, True), (0.01, False)])
def test_an_encoder_shows_its_first_cycle(first, shows):
    """Of cycles 1, 2 and 3 with sine and cosine alike; would catch pairs that are put together wrongly."""
    term = Term("encoder_interpolation", {"lines": 100}, columns=np.ones((3, 6)))
    values = np.array([0.0, first, 0.1, 0.0, 0.0, 0.7])
    found = EFFECTS["encoder_interpolation"].every_part_shows(term, FitEstimate(values, np.eye(6)))
    assert found is shows


def test_ripple_has_as_many_waves_below_the_mesh_as_above_it():
    """Each set of sidebands is even about the mesh: teeth that differ modulate its height and its place."""
    for sides in (*SIDEBANDS, *ZONE_SIDEBANDS):
        assert sides[0] == 0 and sorted(sides) == sorted(-k for k in sides) and len(set(sides)) == len(sides)


class Dropped(Effect):
    """A number and a sine that are declared and nothing else, as of an effect in one file."""

    id = "dropped"
    domain = "order"
    separating = "look"
    declared = (
        Quantity("size_um", "um", "how large", "s", (0.0, 10.0), scale=4.0),
        Sines({3: ("wave_um", "wave_phase_deg")}, "um", "of arc", prior=(0.0, 10.0), scale=1e-3),
    )


def test_what_is_only_declared_is_said_too():
    """A coefficient times its scale, and of its sine both numbers: 3 and 4 um are 5 um at the angle whose tangent is
    4/3. Faults caught: a number that is left out, or taken from the place of another."""
    term = Term("dropped", {}, columns=np.ones((3, 3)))
    said = Dropped().parameters(term, FitEstimate(np.array([1.5, 3e-3, 4e-3]), 1e-12 * np.eye(3)))
    assert {name: (one.value, one.unit) for name, one in said.items()} == {
        "size_um": (pytest.approx(6.0), "um"),
        "wave_um": (pytest.approx(5.0), "um"),
        "wave_phase_deg": (pytest.approx(53.130, abs=1e-3), "deg"),
    }


@pytest.mark.parametrize(("first", "shows"), [(0.11, True), (0.09, False)])
def test_an_eccentric_encoder_shows_its_first_order(first, shows):
    """A tenth of the second at least: without it the second is another effect's."""
    term = Term("encoder_output_eccentricity", {"shaft": "output", "orders": (1, 2)}, columns=np.ones((3, 4)))
    values = np.array([0.0, first, 0.6, 0.8])
    assert EFFECTS["encoder_output_eccentricity"].every_part_shows(term, FitEstimate(values, np.eye(4))) is shows


def test_a_folder_of_effects_must_be_there(tmp_path, monkeypatch):
    monkeypatch.setenv(catalogue.FOLDERS, str(tmp_path))
    path = []
    assert catalogue.find_effects(path, "hdopt.effects") == {}
    assert path == [str(tmp_path)]
    monkeypatch.setenv(catalogue.FOLDERS, str(tmp_path / "none"))
    with pytest.raises(HdoptError, match="which is no folder; correct it or unset HDOPT_EFFECTS"):
        catalogue.find_effects([], "hdopt.effects")


@pytest.mark.parametrize(("sine", "cosine", "skew"), [(0.2, -1.0, 0.1), (-0.3, -1.0, -0.15), (3.0, -1.0, 0.5)])
def test_a_wave_of_the_mesh_becomes_a_form_of_all_teeth(sine, cosine, skew):
    """h ((1 - cos p)/2 + s sin p) varies as -h/2 cos p + h s sin p: s is minus the sine over twice the cosine, as far
    as a form may be skewed. The second form has none and begins where the wave is lowest."""
    term = Term("tooth_mesh", {"sidebands": (0,), "zones": True}, columns=np.ones((3, 4)))
    coefficients = np.array([sine, cosine, sine, cosine])
    skewed, straight = EFFECTS["tooth_mesh"].tooth_by_tooth(term, coefficients, 30.0)
    assert (len(skewed["heights"]), skewed["skew"], skewed["start"]) == (62, pytest.approx(skew), 0.0)
    assert skewed["heights"][0] == pytest.approx(2 * np.hypot(sine, cosine))
    assert straight["skew"] == 0.0
    lowest = 2 * np.pi * straight["start"]
    assert sine * np.sin(lowest) + cosine * np.cos(lowest) == pytest.approx(-np.hypot(sine, cosine))


def test_a_drive_that_stands_has_no_other_law_of_the_speed():
    """Fault caught: a division by no speed."""
    still = replace(RECORD, speed=np.zeros(len(RECORD)))
    term = Term("channel_delay", {}, columns=np.zeros((len(still), 1)))
    for columns in EFFECTS["channel_delay"].other_laws(still, term, np.zeros(len(still)))["speed"]:
        assert np.all(columns == 0)


def test_friction_of_a_locked_input_is_tried_at_each_friction_and_knee():
    locked = replace(RECORD, locked=True)
    term = EFFECTS["hysteresis"].term(locked, {"friction_nm": 5.0, "knee_nm": 3.0})
    assert term.trials == 36
