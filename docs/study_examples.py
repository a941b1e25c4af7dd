"""How each table of a study file is written: one example for each, by the name that the page gives it.

`tests/unit/test_site.py` loads every example beside `drive = "csf-25-80"`, and holds that none is missing.
"""


def _row(inside: str) -> str:
    return f"[tolerances]\naxis_tilt_x_deg = {{ {inside} }}"


def _size(inside: str) -> str:
    return f"[tolerances]\naxis_eccentricity_mm = {{ {inside} }}"


def _cost(inside: str) -> str:
    return _size(f'distribution = "rayleigh", scale = 0.004, upper = 0.012, cost = {{ {inside} }}')


EXAMPLES = {
    "study": '[study]\ntitle = "Hollow shaft joint, variant B"\nsteps = ["waveform", "stack"]',
    "wave_generator": '[wave_generator]\nprofile = "two_disk"\nstructure = "automatic"\nwrap_angle_deg = 60',
    "errors": "[errors]\naxis_eccentricity_mm = 0.012\naxis_eccentricity_direction_deg = 30\naxis_tilt_x_deg = 0.1",
    "operation": '[operation]\nmotion = "both"\noutput_torque_nm = 20\nspeed_rpm = 30',
    "clearances": "[clearances]\nbacklash_mm = 0.012",
    "material": "[material]\nmodulus_mpa = 206000\npoisson = 0.3",
    "load": "[load]\ntorque_nm = 40\ninput_speed_rpm = 1500",
    "tolerances": (
        "[tolerances]\n"
        'axis_tilt_x_deg = { distribution = "normal", std = 0.03, lower = -0.1, upper = 0.1 }\n'
        'axis_eccentricity_mm = { distribution = "rayleigh", scale = 0.004, upper = 0.012 }'
    ),
    "tolerances.correlation": (
        '[[tolerances.correlation]]\nerrors = ["axis_tilt_x_deg", "axis_tilt_y_deg"]\nmatrix = [[1.0, 0.4], [0.4, 1.0]]'
    ),
    'distribution = "normal"': _row('distribution = "normal", std = 0.03, lower = -0.1, upper = 0.1'),
    'distribution = "uniform"': _row('distribution = "uniform", lower = -0.1, upper = 0.1'),
    'distribution = "triangular"': _row('distribution = "triangular", minimum = -0.1, mode = 0, maximum = 0.1'),
    'distribution = "rayleigh"': _size('distribution = "rayleigh", scale = 0.004, upper = 0.012'),
    'distribution = "half_normal"': _size('distribution = "half_normal", scale = 0.004, upper = 0.012'),
    'distribution = "lognormal"': _size('distribution = "lognormal", median = 0.004, log_std = 0.4, upper = 0.02'),
    'distribution = "beta"': _size('distribution = "beta", a = 2, b = 4, maximum = 0.012'),
    'distribution = "measured"': _size('distribution = "measured", file = "eccentricities.csv"'),
    'distribution = "position_zone"': _size('distribution = "position_zone", diameter = 0.02, std = 0.004'),
    'distribution = "fixed"': _row('distribution = "fixed", value = 0.02'),
    'model = "reciprocal"': _cost('model = "reciprocal", a = 1, b = 0.01'),
    'model = "power"': _cost('model = "power", a = 1, b = 0.01, k = 0.5'),
    'model = "exponential"': _cost('model = "exponential", a = 3, b = 0.005, fixed = 0.1'),
    'model = "piecewise"': _cost('model = "piecewise", points = [[0.004, 3.0], [0.008, 1.8], [0.016, 1.2]]'),
    'model = "table"': _cost(
        'model = "table", system = "iso286", nominal_mm = 20, factor = 0.5, '
        'grades = [{ grade = "IT5", cost = 3 }, { grade = "IT6", cost = 2 }, { grade = "IT7", cost = 1.4 }]'
    ),
    "requirement": "[requirement]\npeak_to_peak_arcmin = 0.9\nyield = 0.9973",
    "contributors": (
        "[contributors]\n"
        'bore = { callout = "coaxiality", value_mm = 0.02, feeds = "axis_eccentricity" }\n'
        'face = { callout = "perpendicularity", value_mm = 0.01, length_mm = 40, feeds = "axis_tilt" }'
    ),
    "linear_stack": (
        "[linear_stack]\ngap_tolerance = 0.1\n\n[linear_stack.dimensions]\n"
        "housing = { sensitivity = -1, tolerance = 0.05 }\nshaft = { sensitivity = 1, tolerance = 0.04 }"
    ),
    "allocate": '[allocate]\nrule = "yield"\ncurve = [0.8, 0.9, 1.0, 1.1]',
    "export": '[export]\nbore_mm = 8\nmount = "keyway"\nshaft_fit = "H6/n5"',
    "search": '[search]\nprofiles = ["ellipse", "two_disk"]\nstructures = ["automatic"]',
    "search.variables": "[search.variables]\nwidth_mm = { lower = 6, upper = 10, step = 0.5 }",
    "search.limits.NAME": "[search.limits]\nbearing_life_h = { min = 7000 }\nflank_pressure_mpa = { max = 9.0 }",
    "search.trade": "[search.trade]\nfriction = 0.05",
}
"""Table -> how it is written."""
