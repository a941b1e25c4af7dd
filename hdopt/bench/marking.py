"""Mark one answer against one key.

- Nothing hidden: "adequate" and "insufficient" are right, every other verdict is a false alarm, and so is no answer.
  Where the drive or the bench has something besides (as built, hum) that the records show, "unknown" is right too, and
  so are names that are true of it.
- Hidden physics: right is "named" with the very set.
- Physics outside the catalogue: "unknown" is right.
- Where the likelihood rule, run with the true noise before there is any answer, says that the records cannot tell the
  truth from a rival (`undecidable`), "insufficient" is right as well, and "ambiguous" with the truth among its
  explanations (any, for what is outside); where the rival is the base itself, "adequate" too.
"""

from collections.abc import Iterable
from typing import Any  # Any: values of JSON, as whoever answers may have written them

import numpy as np

IDS = (
    "cs_tooth_harmonics fs_tooth_harmonics tooth_mesh torsional_windup hysteresis lost_motion "
    "encoder_input_eccentricity encoder_output_eccentricity encoder_interpolation output_coupling bearing_pass "
    "circular_spline_lobing thermal_drift resonance local_tooth_defect channel_delay"
).split()
VERDICTS = ("adequate", "named", "ambiguous", "unknown", "insufficient")
CLAIMS = ("named", "ambiguous", "unknown")

# Share of all cases that the likelihood rule may excuse.
MOST_UNDECIDABLE = 0.15

# The parameters that the contract names; what else an answer states is its own affair.
COMPARED = {
    "torsional_windup": ("stiffness_1", "stiffness_2", "stiffness_3", "knee_1", "knee_2"),
    "hysteresis": ("half_loop_arcmin", "transition_deg"),
    "lost_motion": ("lost_motion_arcmin",),
    "thermal_drift": ("coefficient_arcmin_per_k", "time_constant_s"),
    "resonance": ("frequency_hz", "damping_ratio"),
    "channel_delay": ("delay_s",),
    "encoder_interpolation": ("lines",),
    "bearing_pass": ("balls", "ball_to_pitch_ratio"),
    "circular_spline_lobing": ("lobes",),
    "encoder_input_eccentricity": ("amplitude_arcmin",),
    "encoder_output_eccentricity": ("amplitude_arcmin",),
    "output_coupling": ("amplitude_arcmin",),
    "local_tooth_defect": ("angle_deg",),
}
# Since which definitions of the parameters (`Key.definitions`; 1 where a key says none) a key gives them as the
# contract means them: from 90 % of the loop, where more of the pulse shows. Under those before they are reported one by
# one and kept out of the total.
SETTLED = {"transition_deg": 2, "angle_deg": 2}


def check_answer(answer: Any) -> str:
    """What is wrong with an `answer` by the contract, or ""; Any, because whoever answers may write what he likes."""
    if answer is None:
        return "no answer"
    if not isinstance(answer, dict) or answer.get("schema") != 1:
        return "schema is not 1"
    verdict, effects = answer.get("verdict"), answer.get("effects", [])
    if verdict not in VERDICTS:
        return f"verdict {verdict!r} is none of {', '.join(VERDICTS)}"
    others = answer.get("ambiguous_with") or []
    ids = [effect.get("id") for effect in effects] + [name for other in others for name in other]
    unknown = [name for name in ids if name not in IDS]
    if unknown:
        return f"no such effect: {unknown[0]!r}"
    if verdict in ("named", "ambiguous") and not effects:
        return f"{verdict}, but no effect given"
    if verdict == "ambiguous" and not others:
        return "ambiguous, but no other explanation given"
    for effect in effects:
        confidence = effect.get("confidence")
        if not isinstance(confidence, (int, float)) or not 0 <= confidence <= 1:
            return f"confidence of {effect['id']} is {confidence!r}, not between 0 and 1"
    return ""


def explanations(answer: dict[str, Any]) -> list[frozenset[str]]:
    """Sets of effects that the answer offers, the best first."""
    if answer["verdict"] not in ("named", "ambiguous"):
        return []
    sets = [frozenset(effect["id"] for effect in answer["effects"])]
    if answer["verdict"] == "ambiguous":
        sets += [frozenset(other) for other in answer["ambiguous_with"]]
    return list(dict.fromkeys(sets))


def undecidable(keys: Iterable[dict[str, Any]]) -> frozenset[str]:
    """Ids of the `keys` whose records cannot tell the truth from a rival by the likelihood rule, the closest first.

    At most `MOST_UNDECIDABLE` of all cases are excused so; `told_apart` says of each by itself.
    """
    keys = list(keys)
    close = sorted((key for key in keys if not told_apart(key)), key=lambda key: (key["margin"], key["id"]))
    return frozenset(key["id"] for key in close[: int(MOST_UNDECIDABLE * len(keys))])


def told_apart(key: dict[str, Any]) -> bool:
    """Whether the evidence of the records of `key` refutes the base alone and every rival of the truth."""
    return not (key["effects"] or key["outside"]) or key["margin"] >= 1


def credit(answer: dict[str, Any], key: dict[str, Any], excused: bool = False) -> tuple[float, str]:
    """Credit (0 or 1) of a valid `answer` to `key`, and the reason why it is not 1.

    `excused`: the key is one of `undecidable`.
    """
    verdict, sets, truth = answer["verdict"], explanations(answer), frozenset(key["effects"])
    if not truth and not key["outside"]:
        return (1.0, "") if _nothing_is_right(verdict, sets, key) else (0.0, "false alarm")
    if key["outside"]:
        right, modest = verdict == "unknown", verdict == "ambiguous"
        reason = "named what is outside the catalogue" if sets else "missed"
    else:
        right = verdict == "named" and truth <= sets[0] <= truth | frozenset(key["beside_true"])
        modest = verdict == "ambiguous" and truth in sets
        reason = "called unknown" if verdict == "unknown" else "missed"
        if sets:
            reason = f"{len(sets)} explanations" if modest else "wrong set"
    if right or (
        excused and (modest or verdict == "insufficient" or (verdict == "adequate" and not key["detectable"]))
    ):
        return 1.0, ""
    return 0.0, reason


def _nothing_is_right(verdict: str, sets: list[frozenset[str]], key: dict[str, Any]) -> bool:
    if verdict not in CLAIMS:
        return True
    if not key["beside_detectable"]:
        return False
    return verdict == "unknown" or all(offered <= frozenset(key["beside_true"]) for offered in sets)


def improvement(answer: dict[str, Any], key: dict[str, Any]) -> tuple[float, bool]:
    """Held-out gain of `answer` to `key` as a share of the oracle's, at most 1, and whether it claims less than noise.

    The oracle knows the truth: its base alone leaves sqrt(unexplained^2 + noise^2), its extended model the noise. The
    nested held-out error counts, where search and choice saw the training turns alone, or the plain one where an answer
    has no other. Of two readings the worse counts: the relative gain over the answer's own base, and the gain counted
    from the oracle's base (no credit for a base that was fitted badly and then mended).
    """
    noise = key["noise_rms_arcmin"]
    base = float(np.hypot(key["unexplained_rms_arcmin"], noise))
    fit = answer.get("fit") or {}
    said_base, said = fit.get("heldout_rms_base_arcmin"), fit.get("heldout_nested_rms_arcmin")
    said = fit.get("heldout_rms_extended_arcmin") if said is None else said
    if not said_base or said is None or base <= noise:
        return 0.0, False
    relative = (1 - said / said_base) / (1 - noise / base)
    absolute = (base - said) / (base - noise)
    return float(min(relative, absolute, 1.0)), bool(said < 0.8 * noise)


def covered(parameter: dict[str, Any], name: str, truth: dict[str, Any]) -> bool:
    """Whether the interval of a stated `parameter` (its low and high) holds the value of the key's `truth`.

    By its `name` an angle counts modulo 360 deg. An interval without ends does not hold it.
    """
    low, high, value = parameter["low"], parameter["high"], truth["value"]
    if low is None or high is None:
        return False
    if name.endswith("_deg"):
        middle = (low + high) / 2
        value = middle + (value - middle + 180) % 360 - 180
    return bool(low <= value <= high)
