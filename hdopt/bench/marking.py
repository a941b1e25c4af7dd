"""Mark one answer against one key.

- nothing hidden: "adequate" and "insufficient" are right, every other verdict is a false alarm, and so is no answer.
- hidden physics: the exact set named counts 1. An ambiguous answer with k explanations, the true set among them, counts
  1/k, and 0 where the key says that the records tell the truth from all its rivals. Anything else counts 0.
- physics outside the catalogue: "unknown" is right; a named or ambiguous answer is the grave error.
- a decoy that hides physics its records cannot show is right as long as no wrong physics is named.
"""

import numpy as np

IDS = (
    "cs_tooth_harmonics fs_tooth_harmonics tooth_mesh torsional_windup hysteresis lost_motion "
    "encoder_input_eccentricity encoder_output_eccentricity encoder_interpolation output_coupling bearing_pass "
    "circular_spline_lobing thermal_drift resonance local_tooth_defect channel_delay"
).split()
VERDICTS = ("adequate", "named", "ambiguous", "unknown", "insufficient")
CLAIMS = ("named", "ambiguous", "unknown")

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
# Of these the contract leaves zero or definition open: reported one by one, kept out of the total.
OPEN_DEFINITIONS = ("transition_deg", "angle_deg")
# Parameters of which only the size is compared, as the contract does not fix their sign.
SIGN_FREE = ("delay_s",)


def check_answer(answer):
    """What is wrong with an answer by the contract, or ""."""
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


def explanations(answer):
    """Sets of effects that the answer offers, the best first."""
    if answer["verdict"] not in ("named", "ambiguous"):
        return []
    sets = [frozenset(effect["id"] for effect in answer["effects"])]
    if answer["verdict"] == "ambiguous":
        sets += [frozenset(other) for other in answer["ambiguous_with"]]
    return list(dict.fromkeys(sets))


def credit(answer, key):
    """Credit of a valid answer and the reason why it is not 1."""
    verdict, sets, truth = answer["verdict"], explanations(answer), frozenset(key["effects"])
    if key["family"] == "unknown":
        if verdict == "unknown":
            return 1.0, ""
        return 0.0, "named what is outside the catalogue" if sets else "missed"
    if not truth:
        return (0.0, "false alarm") if verdict in CLAIMS else (1.0, "")
    if key["family"] == "decoy" and not key["detectable"]:
        wrong = verdict == "unknown" or any(not offered <= truth for offered in sets)
        return (0.0, "claims what the records cannot show") if wrong else (1.0, "")
    if truth not in sets:
        return 0.0, "wrong set" if sets else "missed" if verdict != "unknown" else "called unknown"
    if len(sets) == 1:
        return 1.0, ""
    if key["separable"]:
        return 0.0, f"{len(sets)} explanations, but the records separate them"
    return 1 / len(sets), f"{len(sets)} explanations"


def improvement(answer, key):
    """Held-out gain as a share of the oracle's, at most 1, and whether a held-out error below the noise is claimed.

    The oracle knows the truth: its base alone leaves sqrt(unexplained^2 + noise^2), its extended model the noise. Of
    two readings the worse counts: the relative gain over the answer's own base, and the gain counted from the oracle's
    base (no credit for a base that was fitted badly and then mended).
    """
    noise = key["noise_rms_arcmin"]
    base = float(np.hypot(key["unexplained_rms_arcmin"], noise))
    fit = answer.get("fit") or {}
    said_base, said_extended = fit.get("heldout_rms_base_arcmin"), fit.get("heldout_rms_extended_arcmin")
    if not said_base or said_extended is None or base <= noise:
        return 0.0, False
    relative = (1 - said_extended / said_base) / (1 - noise / base)
    absolute = (base - said_extended) / (base - noise)
    return float(min(relative, absolute, 1.0)), bool(said_extended < 0.8 * noise)


def covered(parameter, name, truth):
    """Whether a stated interval holds the true value."""
    low, high, value = parameter["low"], parameter["high"], truth["value"]
    if low is None or high is None:
        return False
    if name in SIGN_FREE and value * (low + high) < 0:
        value = -value
    if name.endswith("_deg"):
        middle = (low + high) / 2
        value = middle + (value - middle + 180) % 360 - 180
    return bool(low <= value <= high)
