"""How long a diagnosis takes, and how much memory: a whole process on a recording of 200 input turns x 400 samples.

`make benchmark` prints wall time, processor time and peak memory; the goals are 10 s on two cores and 1 GiB. A ripple
at the teeth, looked for on all rows, and many waves round a spline take longest. Only the memory is asserted: on a
machine that others use as well, even the processor's time doubles.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.study import load_study

pytestmark = [
    pytest.mark.slow,
    pytest.mark.benchmark(group="diagnosis of 200 input turns x 400 samples, whole process"),
]

TURN = 2 * np.pi
LIMIT_KIB = 1024**2

CHILD = """
import json, resource, sys
from hdopt.cli import main
sys.argv[0] = "hdopt"
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
used = resource.getrusage(resource.RUSAGE_SELF)
# Not getrusage: its peak is carried over from the process that started this one.
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
print(json.dumps({"cpu_s": used.ru_utime + used.ru_stime, "peak_kib": int(status["VmHWM"].split()[0])}))
"""


# `make test` asks the cheapest with something hidden; the rest, two minutes of processor time, is for `make benchmark`.
HIDDEN = (
    "hysteresis",
    *(pytest.param(name, marks=pytest.mark.measurement) for name in ("nothing", "tooth_mesh", "cs_tooth_harmonics")),
)


@pytest.fixture(scope="module", params=HIDDEN)
def recorded(request, tmp_path_factory):
    """Path of the recording and what is hidden in it: one pass forward of 100 turns and back, with encoder noise."""
    study = load_study(drive="csf-25-80")
    there = np.arange(100 * 400) * TURN / 400
    theta = np.r_[there, there[::-1]]
    direction = np.r_[np.ones(there.size), -np.ones(there.size)]
    hidden = {
        "nothing": 0.0,
        "tooth_mesh": 0.1 * np.sin(162 * theta),
        # Even waves, which both zones meet alike; many of them are what takes longest.
        "cs_tooth_harmonics": sum(0.1 / k * np.sin(k * theta + k * k) for k in range(2, 30, 2)),
        "hysteresis": 0.15 * direction * (1 - 2 * np.exp(-np.degrees(np.r_[there, there]) / 80 / 1.5)),
    }[request.param]
    noise = np.random.default_rng(0).normal(0, 0.02, theta.size)
    error = kinematic_error_arcmin(study.drive, study.errors, theta) + hidden + noise
    output = theta / 80 - np.radians(error / 60)
    table = pd.DataFrame(
        {
            "time_s": np.arange(theta.size) * TURN / 400 / 6.0,
            "input_angle_deg": np.degrees(theta),
            "output_angle_deg": np.degrees(output),
        }
    )
    path = tmp_path_factory.mktemp("bench") / f"{request.param}.parquet"
    table.to_parquet(path)
    return path, request.param


def test_diagnosis_of_200_turns(benchmark, recorded, tmp_path):
    path, hidden = recorded
    answer = tmp_path / "answer.json"
    command = [sys.executable, "-c", CHILD, "diagnose", str(path), "--drive", "csf-25-80", "--json", str(answer)]

    def diagnosed():
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ, check=True)
        return json.loads(done.stdout.splitlines()[-1])

    used = benchmark.pedantic(diagnosed, rounds=1, iterations=1)
    benchmark.extra_info |= used | {"hidden": hidden}
    said = {found["id"] for found in json.loads(answer.read_text())["effects"]}
    print(f"{hidden}: {used['cpu_s']:.1f} s of processor time, {used['peak_kib'] / 1024:.0f} MiB, found {sorted(said)}")
    assert said == ({hidden} if hidden != "nothing" else set())
    assert used["peak_kib"] < LIMIT_KIB
