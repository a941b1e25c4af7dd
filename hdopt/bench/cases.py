"""One blind case: what is asked for, the recordings that go out, and the key that stays behind."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, TypeAlias  # Any: values of JSON

import numpy as np
import pandas as pd

from hdopt.bench.arrays import Array
from hdopt.bench.evidence import Witness
from hdopt.bench.gears import CSF, GEARS, Gear, as_built
from hdopt.bench.geometry import ARCMIN, BaseErrors, draw_errors, find_zones
from hdopt.bench.hidden_drive import BearingPass, Lobing, LocalDefect, LongWave, ToothMesh
from hdopt.bench.hidden_load import Hysteresis, LostMotion, Resonance, ThermalDrift, Windup
from hdopt.bench.hidden_outside import Outside
from hdopt.bench.hidden_sensors import ChannelDelay, Coupling, Eccentricity, Interpolation
from hdopt.bench.instrument import Instrument, draw_instrument, record
from hdopt.bench.motion import Plan, draw_plans, draw_ripple, run
from hdopt.bench.readings import READINGS, as_read, through
from hdopt.bench.signal_chain import Hidden, Setup, hidden_wave, joint_rms, read_angles, read_error, set_up

CATALOGUE: dict[str, Callable[..., Hidden]] = {
    "cs_tooth_harmonics": partial(LongWave.draw, on="cs"),
    "fs_tooth_harmonics": partial(LongWave.draw, on="fs"),
    "tooth_mesh": ToothMesh.draw,
    "torsional_windup": Windup.draw,
    "hysteresis": Hysteresis.draw,
    "lost_motion": LostMotion.draw,
    "encoder_input_eccentricity": partial(Eccentricity.draw, on="input"),
    "encoder_output_eccentricity": partial(Eccentricity.draw, on="output"),
    "encoder_interpolation": Interpolation.draw,
    "output_coupling": Coupling.draw,
    "bearing_pass": BearingPass.draw,
    "circular_spline_lobing": Lobing.draw,
    "thermal_drift": ThermalDrift.draw,
    "resonance": Resonance.draw,
    "local_tooth_defect": LocalDefect.draw,
    "channel_delay": ChannelDelay.draw,
}

ToAndFro: TypeAlias = Hysteresis | LostMotion | ChannelDelay
"""Physics of a reversal, which knows what it would make in a test to and fro."""

Sized: TypeAlias = tuple[Hidden, list[Array]]
"""Physics as large as asked for, and its wave (rad) in each recording."""

Parameters: TypeAlias = dict[str, dict[str, Any]]
"""Name -> {value, unit, identifiable}."""

DEFINITIONS = 2
"""Of the parameters in a key: raised where one comes to mean something else (`marking.SETTLED`)."""

TROUBLES = ("gaps", "coloured", "ripple", "short", "one way", "coarse", "clock")

# One of each pair is a special case of the other, as far as any recording goes.
ONE_IN_THE_OTHER = (
    {"circular_spline_lobing", "cs_tooth_harmonics"},
    {"encoder_output_eccentricity", "output_coupling"},
)

# Draws until physics can be as large as asked for: an encoder's error, a swing have a largest size. No case is drawn
# anew for any other reason; `Key.redrawn` says how often, and the last draw is taken as large as it can be.
ATTEMPTS = 14


@dataclass(frozen=True)
class Spec:
    """What a case is to be. `effects` are catalogue ids; `outside` a kind of physics beyond it."""

    family: str  # "nothing", "single", "pair", "decoy", "unknown"
    seed: int
    effects: tuple[str, ...] = ()
    severity: float = 0.0  # hidden rms of each effect, in units of the base's rms
    outside: str = ""
    trouble: str = ""
    size: str = ""  # of the record, as in `draw_plans`; by the family where empty
    reading: str = ""  # of `readings`: how the bench counts and samples
    whole_motion: bool = False  # a resonance swings with all of its foot's motion, not with the error alone
    gear: str = CSF.name  # of `gears.GEARS`
    built: str = ""  # of `gears.BUILT`: what the drive has as it is built
    turns: float = 0.0  # input turns of a stroke, where the size does not say
    hum: float = 0.0  # 50 Hz mains in the output's reading, rms in units of the noise's
    speed_steps: bool = False


@dataclass(frozen=True)
class Key:
    """The truth of one case. Waves and noise in arcmin rms, means of each recording removed."""

    id: str
    family: str
    seed: int
    effects: tuple[str, ...]
    variants: tuple[str, ...]
    outside: str
    trouble: str
    reading: str
    severity: float
    base_rms_arcmin: float
    hidden_rms_arcmin: float  # of all hidden physics together
    part_rms_arcmin: dict[str, float]
    noise_rms_arcmin: float
    unexplained_rms_arcmin: float  # of the hidden wave, after the base alone was refitted
    detectable: bool
    separable: bool
    rivals: tuple[str, ...]
    parameters: dict[str, Parameters]  # id -> name -> {value, unit, identifiable}
    conditions: dict[str, Any]
    gear: str = CSF.name
    built: str = ""
    margin: float | None = None  # evidence against the closest rival, or the base, in units of what decides
    beside_rms_arcmin: float = 0.0  # of what the drive and the bench have besides: as built, hum
    beside_detectable: bool = False
    beside_true: tuple[str, ...] = ()  # names of the catalogue that would be true of it
    redrawn: int = 0
    definitions: int = DEFINITIONS  # of the parameters, as `marking.SETTLED` counts them

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class Case:
    """What goes out: the tables, and nothing that hints at what is in them."""

    id: str
    recordings: tuple[pd.DataFrame, ...]


def generate(spec: Spec, name: str = "case") -> tuple[Case, Key]:
    """Case and key of `spec`, called `name`; the same seed gives the same numbers."""
    for effect in spec.effects:
        if effect not in CATALOGUE:
            raise ValueError(f"unknown effect {effect!r}; the bench knows {', '.join(CATALOGUE)}")
    if spec.reading not in READINGS:
        raise ValueError(f"unknown reading {spec.reading!r}; the bench knows {', '.join(filter(None, READINGS))}")
    if spec.gear not in GEARS:
        raise ValueError(f"unknown gear {spec.gear!r}; the bench knows {', '.join(GEARS)}")
    rng = _generator(spec)
    for attempt in range(ATTEMPTS):
        drawn = _simulate(spec, rng, last=attempt == ATTEMPTS - 1)
        if drawn is not None:
            return Case(name, drawn.tables), replace(_key(spec, name, drawn, rng), redrawn=attempt)
    raise AssertionError("the last draw is taken as it is")


def _generator(spec: Spec) -> np.random.Generator:
    return np.random.default_rng([spec.seed, len(spec.effects), int(1000 * spec.severity)])


def simulate(spec: Spec, rng: np.random.Generator | None = None) -> Simulated | None:
    """The first draw of `spec`, without a key: a `Simulated`, or None where the physics cannot be so large in it.

    It is drawn from the seed of `spec`, or from `rng`.
    """
    return _simulate(spec, _generator(spec) if rng is None else rng)


@dataclass(frozen=True)
class Simulated:
    """One draw of a case: its drive and motion, what is hidden in it and how large, and what the instrument wrote."""

    plans: tuple[Plan, ...]
    setups: list[Setup]
    hidden: list[Hidden]
    waves: list[list[Array]]  # of each hidden physics alone, one array a recording
    instrument: Instrument
    tables: tuple[pd.DataFrame, ...]
    noise_rms: float
    base_rms: float
    torque_gain: float
    beside: list[Array]  # waves of what the drive and the bench have besides, one array a recording

    def parameters(self) -> dict[str, Parameters]:
        """True parameters of the catalogue's physics in it: id -> name -> {value, unit, identifiable}."""
        top = self.torque_gain * max(float(np.abs(s.run.torque).max()) for s in self.setups)
        pairs = zip(self.hidden, self.waves, strict=True)
        return {h.id: _parameters(h, top, self.setups, waves) for h, waves in pairs if h.id}


def _simulate(spec: Spec, rng: np.random.Generator, last: bool = False) -> Simulated | None:
    gear = GEARS[spec.gear]
    errors = draw_errors(rng)
    hidden = [CATALOGUE[effect](rng, gear=gear) for effect in spec.effects]
    if spec.outside:
        hidden.append(Outside.draw(rng, spec.outside))
    plans = _plans(spec, hidden, rng)
    hidden = [physics.for_plans(plans) for physics in hidden]
    if spec.whole_motion:
        hidden = [replace(h, whole_motion=True) if isinstance(h, Resonance) else h for h in hidden]
    instrument = through(spec.reading, draw_instrument(rng, len(plans), frozenset([spec.trouble])))
    real = as_built(gear, spec.built, rng) if spec.built else gear
    setups = [set_up(errors, run(plan, instrument.jitter, rng, gear.ratio), real) for plan in plans]
    base_rms = joint_rms([read_error(s) for s in setups])
    sized = _sized(spec, hidden, setups, base_rms, last)
    if sized is None:
        return None
    hidden, waves = [physics for physics, _ in sized], [waves for _, waves in sized]
    beside, hum = _beside(spec, setups, errors, gear, instrument)
    gain = float(np.prod([physics.torque_gain for physics in hidden]))
    tables, noises = zip(
        *[
            record(instrument, rank, plan, s.run, read_angles(s, [*hidden, *hum]), gain * s.run.torque, rng)
            for rank, (plan, s) in enumerate(zip(plans, setups, strict=True))
        ],
        strict=True,
    )
    tables = tuple(as_read(spec.reading, table, rng) for table in tables)
    return Simulated(plans, setups, hidden, waves, instrument, tables, joint_rms(noises), base_rms, gain, beside)


def _sized(
    spec: Spec, hidden: Sequence[Hidden], setups: Sequence[Setup], base_rms: float, as_it_is: bool
) -> list[Sized] | None:
    """Hidden physics as large as `spec` asks for, each with its waves; where one cannot be, None or `as_it_is`."""
    deaf = {"reversal", "speeds"} if spec.trouble == "one way" else set()
    target = spec.severity * base_rms
    found = [
        _as_if_reversed(physics, setups, target)
        if physics.needs & deaf and isinstance(physics, ToAndFro)
        else scaled_to(physics, setups, target, as_it_is)
        for physics in (hidden if target else [])
    ]
    sized = [one for one in found if one is not None]
    return sized if len(sized) == len(found) else None


def _beside(
    spec: Spec, setups: Sequence[Setup], errors: BaseErrors, gear: Gear, instrument: Instrument
) -> tuple[list[Array], list[Outside]]:
    """Waves of what the drive as built and the bench have besides, one a recording, and the hum among it."""
    hum = []
    if spec.hum:
        # Two tones, the third harmonic at 0.6 at most: rms 0.7 to 0.8 of the scale.
        hum = [Outside("mains", spec.seed, scale=spec.hum * instrument.noise_arcmin / 0.75)]
    waves = []
    for s in setups:
        nominal = replace(s, gear=gear, zones=find_zones(errors, s.run.theta, gear)) if spec.built else s
        waves.append(read_error(s, hum) - read_error(nominal))
    return (waves if spec.built or spec.hum else []), hum


def _key(spec: Spec, name: str, drawn: Simulated, rng: np.random.Generator) -> Key:
    hidden, setups, waves = drawn.hidden, drawn.setups, drawn.waves
    together = [hidden_wave(s, hidden) for s in setups] if len(hidden) != 1 else waves[0]
    return Key(
        id=name,
        family=spec.family,
        seed=spec.seed,
        effects=tuple(sorted(spec.effects)),
        variants=tuple(physics.variant for physics in hidden),
        outside=spec.outside,
        trouble=spec.trouble,
        reading=spec.reading,
        severity=spec.severity,
        base_rms_arcmin=drawn.base_rms / ARCMIN,
        hidden_rms_arcmin=joint_rms(together) / ARCMIN,
        part_rms_arcmin={h.id or h.variant: joint_rms(w) / ARCMIN for h, w in zip(hidden, waves, strict=True)},
        noise_rms_arcmin=drawn.noise_rms / ARCMIN,
        parameters=drawn.parameters(),
        conditions=_conditions(drawn.plans, setups),
        gear=spec.gear,
        built=spec.built,
        **_weigh(drawn, together, rng),
        **_weigh_beside(spec, drawn, rng),
    )


def _plans(spec: Spec, hidden: Sequence[Hidden], rng: np.random.Generator) -> tuple[Plan, ...]:
    needs = frozenset().union(*[physics.needs for physics in hidden])
    size = spec.size or ("small" if spec.family == "nothing" else "full")
    if spec.trouble == "one way":
        needs = needs - {"reversal", "speeds"} | {"one way"}
    if spec.trouble == "short":
        size = "short"
    plans = draw_plans(rng, needs, size, GEARS[spec.gear].ratio, spec.turns)
    if spec.speed_steps:
        plans = tuple(replace(p, speed_steps=tuple(rng.permutation([0.3, 0.5, 0.75, 1.0]))) for p in plans)
    if spec.trouble == "ripple":
        plans = tuple(replace(p, ripple=draw_ripple(rng, rng.uniform(0.05, 0.2))) for p in plans)
    return plans


def scaled_to(physics: Hidden, setups: Sequence[Setup], target: float, as_it_is: bool = False) -> Sized | None:
    """`physics` scaled to an rms of `target` (rad) over `setups`, and its waves.

    Where it cannot be so large: None, or with `as_it_is` as large as it can be.
    """
    scale = physics.scale
    for _ in range(25):
        physics = physics.scaled(scale)
        waves = [hidden_wave(s, [physics]) for s in setups]
        rms = joint_rms(waves)
        if abs(rms / target - 1) < 0.005:
            break
        # In proportion at first; by half steps close by, where the zone switch spoils the proportion.
        step = np.clip(target / rms, 0.01, 100) if rms else 10.0
        step = step if abs(np.log(step)) > 0.1 else np.sqrt(step)
        scale = float(np.clip(scale * step, *physics.scale_range))
    return (physics, waves) if as_it_is or abs(rms / target - 1) < 0.02 else None


def _as_if_reversed(physics: ToAndFro, setups: Sequence[Setup], target: float) -> Sized:
    """Physics in a test without the reversal that it needs: as large as would give `target` with one."""
    physics = physics.scaled(physics.scale_for(target, max(np.abs(s.run.speed).max() / s.run.ratio for s in setups)))
    return physics, [hidden_wave(s, [physics]) for s in setups]


def _weigh(drawn: Simulated, together: Sequence[Array], rng: np.random.Generator) -> dict[str, Any]:
    hidden = drawn.hidden
    if not hidden:
        return {"unexplained_rms_arcmin": 0.0, "detectable": False, "separable": False, "rivals": (), "margin": None}
    witness = Witness(drawn.setups, drawn.plans, rng)

    def sampled(parts: Sequence[Array]) -> Array:
        return np.concatenate([part[pick] for part, pick in zip(parts, witness.pick, strict=True)])

    share = drawn.instrument.effective(1.0)
    parts = [sampled(wave) for wave in drawn.waves]
    detectable, rivals, margin = True, set(), np.inf
    for rank, physics in enumerate(hidden):
        # A second physics is free to take up what it can of the first, so all its columns stand beside its wave.
        others = [other for other in range(len(hidden)) if other != rank]
        beside = [parts[other][:, None] for other in others] + [witness.family(hidden[other].id) for other in others]
        evidence = witness.weigh(parts[rank], physics.id, drawn.noise_rms, share, beside)
        detectable &= evidence.detectable
        rivals |= {*evidence.rivals, *physics.same_as}
        # Linear columns leave a little of what a change of zones makes; the same recording leaves nothing.
        margin = min(margin, 0.0 if physics.same_as else evidence.margin)
    return {
        "unexplained_rms_arcmin": witness.refit(sampled(together)) / ARCMIN,
        "detectable": bool(detectable),
        "separable": not rivals,
        "rivals": tuple(sorted(rivals)),
        "margin": margin,
    }


TRUE_OF_BUILT = {"pitch errors": ("cs_tooth_harmonics", "fs_tooth_harmonics")}
"""Names of the catalogue that are true of a drive as built: each tooth's own error has waves of every length."""


def _weigh_beside(spec: Spec, drawn: Simulated, rng: np.random.Generator) -> dict[str, Any]:
    if not drawn.beside:
        return {}
    witness = Witness(drawn.setups, drawn.plans, rng)
    wave = np.concatenate([wave[pick] for wave, pick in zip(drawn.beside, witness.pick, strict=True)])
    evidence = witness.weigh(wave, "", drawn.noise_rms, drawn.instrument.effective(1.0))
    return {
        "beside_rms_arcmin": joint_rms(drawn.beside) / ARCMIN,
        "beside_detectable": bool(evidence.detectable),
        "beside_true": TRUE_OF_BUILT.get(spec.built, ()),
    }


def _parameters(physics: Hidden, top_torque: float, setups: Sequence[Setup], waves: Sequence[Array]) -> Parameters:
    found = physics.truth_under(top_torque) if isinstance(physics, Windup) else physics.truth_in(setups, waves)
    return {name: asdict(parameter) for name, parameter in found.items()}


def _conditions(plans: Sequence[Plan], setups: Sequence[Setup]) -> dict[str, Any]:
    return {
        "recordings": len(plans),
        "samples": int(sum(s.run.time.size for s in setups)),
        "legs": [list(plan.legs) for plan in plans],
        "samples_per_turn": plans[0].samples_per_turn,
        "torque": plans[0].torque.shape if plans[0].torque else "",
        "temperature": plans[0].log_temperature,
    }
