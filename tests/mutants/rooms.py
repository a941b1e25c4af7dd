"""The rooms whose faults are counted: their target, and the tests that must kill them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Room:
    """A room of hdopt: the share of mutants that must be killed, and its tests as patterns below `tests`."""

    target: float
    tests: tuple[str, ...]


ROOMS = {
    "kinematics": Room(
        0.90,
        (
            "unit/test_kinematics*.py",
            "unit/test_peak_to_peak.py",
            "unit/test_cartesian.py",
            "unit/test_homogenization.py",
            "validation/test_jia_2021*.py",
        ),
    ),
    "mechanics": Room(
        0.90,
        (
            "unit/test_lag.py",
            "unit/test_contact_and_bending.py",
            "unit/test_tooth_path.py",
            "validation/test_jia_2021*.py",
            "validation/test_harmonic_drive_engineering_data.py",
        ),
    ),
    "tolerance": Room(
        0.90,
        (
            "unit/test_stack.py",
            "unit/test_proven_bound.py",
            "unit/test_distributions.py",
            "unit/test_copula.py",
            "unit/test_tail_correlation.py",
            "unit/test_workflow_stack.py",
            "validation/*.py",
        ),
    ),
    "effects": Room(
        0.90,
        (
            "unit/test_simulation*.py",
            "unit/test_friction_law.py",
            "unit/test_base_excitation.py",
            "unit/test_unsteady.py",
        ),
    ),
    "recordings": Room(0.90, ("unit/test_recording*.py", "unit/test_orders.py")),
    "diagnosis": Room(
        0.85,
        ("unit/test_diagnosis*.py", "unit/test_penalty.py", "unit/test_acceptance.py", "unit/test_confounding.py"),
    ),
}
