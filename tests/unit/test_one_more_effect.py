"""What completes a set that is only begun: sets that were tried before count beside those fitted anew."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.search import completion
from hdopt.diagnosis.search.completion import known_with_one_more, with_one_more
from hdopt.diagnosis.search.search_state import names_of
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects.declared import Shaft
from hdopt.effects.term import Term

WIDE = 40


def fit_of(*effects, width=2):
    """A fit of these effects, each of so many coefficients."""
    terms = [
        Term(
            effect,
            {"shaft": Shaft.INPUT, "orders": (1,)},
            columns=np.zeros((3, width)),
            doubtful=effect == "hysteresis",
        )
        for effect in effects
    ]
    return SimpleNamespace(terms=terms, problem=SimpleNamespace(settings=DEFAULT))


BEGUN = fit_of("local_tooth_defect")


def state_of(*fits):
    return SimpleNamespace(fits={names_of(fit): fit for fit in fits})


@pytest.mark.parametrize("sines_alone", [False, True])
def test_a_set_that_was_tried_before_completes_too(sines_alone):
    """Fault caught: only what is fitted from the begun set on counts, which may be another drive."""
    pair = fit_of("encoder_input_eccentricity", "local_tooth_defect")
    assert known_with_one_more(state_of(BEGUN, pair), BEGUN, sines_alone) == [pair]


def test_what_is_no_sine_completes_only_where_any_may():
    """Fault caught: a thermal drift that brings a drive home."""
    pair = fit_of("local_tooth_defect", "thermal_drift")
    assert known_with_one_more(state_of(pair), BEGUN, sines_alone=False) == [pair]
    assert known_with_one_more(state_of(pair), BEGUN, sines_alone=True) == []


@pytest.mark.parametrize(
    "other",
    [
        fit_of("local_tooth_defect"),
        fit_of("encoder_input_eccentricity"),
        fit_of("encoder_input_eccentricity", "thermal_drift"),
        fit_of("local_tooth_defect", "encoder_input_eccentricity", "thermal_drift"),
        fit_of("local_tooth_defect", "_sine_in_angle"),
        fit_of("local_tooth_defect", "resonance"),
        fit_of("local_tooth_defect", "hysteresis"),
        fit_of("local_tooth_defect", "encoder_interpolation", width=WIDE),
    ],
    ids=lambda fit: " and ".join(term.effect for term in fit.terms),
)
def test_others_do_not(other):
    """The set itself, others without its effects, two effects more, and what is not plain: without physics, driven,
    doubtful, or of many coefficients. Faults caught: each of these let in."""
    assert known_with_one_more(state_of(other), BEGUN, sines_alone=False) == []


def test_of_a_set_fitted_anew_and_one_tried_before_the_better_stands(monkeypatch):
    """Faults caught: what was tried before left out; what is fitted anew left out; the worse of both."""
    fits = {name: fit_of("local_tooth_defect", "encoder_input_eccentricity") for name in ("known", "anew", "driven")}
    term = fits["anew"].terms[1]
    monkeypatch.setattr(completion, "joint_fit", lambda *_: fits["anew"])
    monkeypatch.setattr(completion, "from_new_drives", lambda *_: [fits["driven"]])
    state = SimpleNamespace(
        fits={names_of(fits["known"]): fits["known"]},
        settings=SimpleNamespace(most_plain=1),
        probe=lambda fit: SimpleNamespace(gain=lambda term: 1.0),
        terms_for=lambda *_: [term],
        rng=np.random.default_rng(0),
    )
    for least in fits:
        for name, fit in fits.items():
            fit.objective = 1.0 if name == least else 2.0
        found = with_one_more(state, BEGUN, lambda fit: False, sines_alone=False)
        assert [one is fits[least] for one in found] == [True]


@pytest.mark.parametrize(
    ("effects", "kept"),
    [
        (("channel_delay", "_skew"), ("channel_delay",)),
        (("_scale", "channel_delay", "lost_motion", "_zero"), ("channel_delay", "lost_motion")),
        (("channel_delay",), None),
        (("_skew",), None),
        (("channel_delay", "_varying_contact"), None),
    ],
)
def test_what_is_told_is_put_aside(monkeypatch, effects, kept):
    """A clock that runs apart had taken up a part of the friction beside a delay, so that the two, without a skew, did
    not complete the delay with one: four of four were `unknown`. A contact that varies is the drive's own, and stays.
    """
    monkeypatch.setattr(completion, "with_only", lambda fit, keep: tuple(fit.terms[i].effect for i in keep))
    assert completion.without_told(fit_of(*effects)) == ([] if kept is None else [kept])


def test_a_set_is_completed_without_what_is_told_too(monkeypatch):
    """Fault caught: sets that complete the first with its skew alone."""
    asked = []
    first = SimpleNamespace(fit=fit_of("channel_delay", "_skew"), effects=("channel_delay", "_skew"), outside=False)
    monkeypatch.setattr(completion, "with_only", lambda fit, keep: fit_of(*(fit.terms[i].effect for i in keep)))
    monkeypatch.setattr(completion, "with_one_more", lambda state, fit, *_: asked.append(names_of(fit)) or [])
    monkeypatch.setattr(completion, "is_outside_tolerances", lambda fit: False)
    state = SimpleNamespace(
        settings=DEFAULT.search,
        above_noise=lambda fit: 1e6,
        scale=SimpleNamespace(rows=1000, settings=DEFAULT.penalty),
        top_gain=1.0,
        inflation=1.0,
    )
    assert completion.by_one_plain_effect(state, first) == []
    assert asked == [names_of(first.fit), names_of(fit_of("channel_delay"))]
