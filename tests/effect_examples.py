"""One or more of every effect of the catalogue as its keys in a study file, and a condition that all can work at."""

from __future__ import annotations

OPERATION = {
    "motion": "both",
    "output_torque_nm": 20.0,
    "speed_rpm": 30.0,
    "temperature_difference_k": 5.0,
    "time_s": 0.0,
}

EXAMPLES: list[tuple[str, dict]] = [
    ("cs_tooth_harmonics", {"amplitude_2_um": 1.5, "phase_2_deg": 30.0, "amplitude_3_um": 0.5, "phase_3_deg": -60.0}),
    ("fs_tooth_harmonics", {"amplitude_2_um": 1.0, "phase_2_deg": 100.0}),
    ("tooth_mesh", {"amplitude_arcmin": 0.05, "phase_deg": 10.0}),
    (
        "tooth_mesh",
        {
            "amplitude_arcmin": 0.05,
            "phase_deg": 10.0,
            "amplitude_minus_2_arcmin": 0.02,
            "phase_minus_2_deg": 20.0,
            "amplitude_plus_2_arcmin": 0.01,
            "phase_plus_2_deg": 30.0,
        },
    ),
    (
        "tooth_mesh",
        {
            "zone_1_amplitude_um": 1.0,
            "zone_1_phase_deg": 10.0,
            "zone_2_amplitude_um": 1.5,
            "zone_2_phase_deg": 20.0,
            "zone_2_amplitude_minus_1_um": 0.2,
            "zone_2_phase_minus_1_deg": 30.0,
        },
    ),
    (
        "torsional_windup",
        {
            "stiffness_1_nm_per_rad": 31000.0,
            "stiffness_2_nm_per_rad": 50000.0,
            "stiffness_3_nm_per_rad": 57000.0,
            "knee_1_nm": 14.0,
            "knee_2_nm": 48.0,
        },
    ),
    (
        "torsional_windup",
        {"stiffness_1_nm_per_rad": -31000.0, "variation_over_turn": 0.1, "variation_phase_deg": 25.0},
    ),
    ("hysteresis", {"half_loop_arcmin": 0.2, "transition_deg": 1.5, "model": "dahl"}),
    ("hysteresis", {"half_loop_arcmin": 0.2, "transition_deg": 1.5, "model": "maxwell_slip"}),
    ("hysteresis", {"half_loop_arcmin": 0.2, "transition_deg": 1.5, "model": "bouc_wen_square"}),
    ("lost_motion", {"lost_motion_arcmin": 0.3, "crossing_arcmin": 0.3}),
    (
        "lost_motion",
        {
            "lost_motion_arcmin": 0.3,
            "crossing_arcmin": 0.3,
            "variation_order": 2,
            "variation_arcmin": 0.05,
            "variation_phase_deg": 40.0,
        },
    ),
    ("encoder_input_eccentricity", {"amplitude_arcmin": 0.1, "phase_deg": 15.0}),
    ("encoder_output_eccentricity", {"amplitude_arcmin": 0.1, "phase_deg": 15.0}),
    (
        "encoder_output_eccentricity",
        {
            "amplitude_arcmin": 0.1,
            "phase_deg": 15.0,
            "amplitude_output_2_arcmin": 0.04,
            "phase_output_2_deg": 70.0,
        },
    ),
    ("encoder_interpolation", {"shaft": "input", "lines": 25, "amplitude_arcmin": 0.05, "phase_deg": 5.0}),
    ("encoder_interpolation", {"shaft": "output", "lines": 4001, "amplitude_2_arcmin": 0.05, "phase_2_deg": 5.0}),
    (
        "encoder_interpolation",
        {
            "shaft": "output",
            "lines": 500,
            "amplitude_arcmin": 0.05,
            "phase_deg": 5.0,
            "amplitude_4_arcmin": 0.01,
            "phase_4_deg": 15.0,
        },
    ),
    ("output_coupling", {"shaft": "output", "amplitude_arcmin": 0.1, "phase_deg": 15.0}),
    ("output_coupling", {"shaft": "input", "amplitude_arcmin": 0.1, "phase_deg": 15.0}),
    (
        "bearing_pass",
        {
            "ball_to_pitch_ratio": 0.14,
            "balls": 31,
            "unequal_2_um": 0.5,
            "unequal_2_phase_deg": 25.0,
            "unequal_31_um": 0.3,
            "unequal_31_phase_deg": 35.0,
        },
    ),
    (
        "bearing_pass",
        {
            "ball_to_pitch_ratio": 0.14,
            "balls": 18,
            "cage_arcmin": 0.05,
            "cage_phase_deg": 10.0,
            "outer_pass_arcmin": 0.04,
            "outer_pass_phase_deg": 80.0,
        },
    ),
    ("bearing_pass", {"ball_to_pitch_ratio": 0.14, "unequal_2_um": 1.0, "unequal_2_phase_deg": 10.0}),
    ("circular_spline_lobing", {"lobes": 6, "radial_amplitude_um": 5.0, "phase_deg": 17.0}),
    ("thermal_drift", {"coefficient_arcmin_per_k": 0.03}),
    ("thermal_drift", {"amplitude_arcmin": 0.5, "time_constant_s": 60.0}),
    ("resonance", {"frequency_hz": 3.0, "damping_ratio": 0.05, "gain": 0.9, "output_share_of_damping": 0.4}),
    ("local_tooth_defect", {"on": "flexspline", "angle_deg": 115.0, "width_deg": 5.0, "height_um": 4.0}),
    ("local_tooth_defect", {"on": "output", "angle_deg": 2000.0, "width_deg": 5.0, "height_arcmin": 0.3}),
    (
        "local_tooth_defect",
        {
            "on": "circular_spline_twice",
            "angle_deg": 100.0,
            "width_deg": 3.0,
            "height_arcmin": 0.2,
            "height_2_arcmin": 0.1,
        },
    ),
    ("channel_delay", {"delay_s": 0.002}),
]

NAMES = [f"{name}-{i}" for i, (name, _) in enumerate(EXAMPLES)]


def toml(effects: dict[str, dict], operation: dict | None = None) -> str:
    """A study of the CSF-25-80 with these effects at this operation."""
    lines = ['drive = "csf-25-80"']
    for table, content in {
        "operation": operation or {},
        **{f"effects.{name}": keys for name, keys in effects.items()},
    }.items():
        lines += [f"[{table}]"]
        lines += [f"{k} = {f'{v!r}'.replace(chr(39), chr(34))}" for k, v in content.items()]
    return "\n".join(lines) + "\n"
