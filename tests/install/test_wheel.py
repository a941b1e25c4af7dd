"""The built wheel, installed with what it needs in a fresh environment outside the repository."""

import json
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.slow


def run(*command, cwd):
    return subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True, timeout=900)


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    built = run(
        sys.executable, "-m", "pip", "wheel", ROOT, "--no-deps", "--no-build-isolation", "-w", folder, cwd=folder
    )
    assert built.returncode == 0, built.stderr
    (wheel,) = folder.glob("hdopt-*.whl")
    venv.create(folder / "environment")
    commands = folder / "environment" / ("Scripts" if sys.platform == "win32" else "bin")
    uv, python = Path(sys.executable).with_name("uv"), commands / "python"
    tool = [uv, "pip", "install", "--python", python] if uv.exists() else [python, "-m", "pip", "install"]
    if not uv.exists():
        assert run(python, "-m", "ensurepip", cwd=folder).returncode == 0
    install = run(*tool, "-q", wheel, "-c", ROOT / "requirements.lock", cwd=folder)
    assert install.returncode == 0, install.stderr
    return folder, commands / "hdopt"


def test_ke_runs_from_the_installed_wheel(installed):
    folder, hdopt = installed
    found = run(hdopt, "ke", "--json", "-", cwd=folder)
    assert found.returncode == 0, found.stderr
    assert json.loads(found.stdout)["peak_to_peak_arcmin"] == pytest.approx(1.3694, abs=1e-4)


def test_the_wheel_brings_studies_templates_and_geometry(installed):
    folder, hdopt = installed
    listed = run(hdopt, "studies", cwd=folder)
    assert "paper-reproduction" in listed.stdout
    (folder / "quick.toml").write_text('drive = "csf-25-80"\n[study]\nsteps = ["orders"]\n')
    ran = run(hdopt, "run", "quick.toml", "-o", "out", cwd=folder)
    assert ran.returncode == 0, ran.stderr
    assert (folder / "out" / "report.html").stat().st_size > 1_000_000
    (wheel,) = folder.glob("hdopt-*.whl")
    brought = set(zipfile.ZipFile(wheel).namelist())
    sources = {"hdopt": ROOT / "hdopt", "hdopt/geometry": ROOT / "geometry", "hdopt/studies": ROOT / "studies"}
    wanted = {
        f"{name}/{path.relative_to(source)}"
        for name, source in sources.items()
        for path in source.rglob("*.*")
        if path.suffix not in (".pyc", ".nbi", ".nbc")
    }
    assert wanted <= brought, wanted - brought
    python = hdopt.parent / "python"
    assert run(python, "-c", "import hdopt.geometry, hdopt.studies", cwd=folder).returncode == 0


def test_a_blind_proof_runs_from_the_installed_wheel(installed):
    folder, hdopt = installed
    one = ('concealed.families=["nothing"]', "concealed.share=0.001", "concealed.seed=2009")
    small = [word for setting in one for word in ("--set", setting)]
    ran = run(hdopt, "run", "concealed-physics", "-o", "proof", *small, cwd=folder)
    assert ran.returncode == 1 and "Traceback" not in ran.stderr, ran.stderr  # one case is no proof: the answer is "no"
    assert "no answer" not in ran.stdout and (folder / "proof" / "report.html").exists()
