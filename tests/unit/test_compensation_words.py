"""What a compensation says of itself beside its numbers."""

from types import SimpleNamespace

import pytest

from hdopt.workflow import compensate
from hdopt.workflow.compensate import VOID, VOID_OF_STRAIN_WAVE, Compensated


@pytest.mark.parametrize(("strain_wave", "said"), [(True, VOID_OF_STRAIN_WAVE), (False, VOID)])
def test_only_a_harmonic_drive_has_a_wave_generator_to_take_out(strain_wave, said):
    """Fault caught: a planetary gear told that its circular spline may have been turned."""
    made = SimpleNamespace(strain_wave=strain_wave)
    assert Compensated.void.fget(made) == said
    assert ("wave generator" in said) is strain_wave


@pytest.mark.parametrize(("neighbours", "told"), [(1, False), (2, True), (4, True)])
def test_averaged_samples_are_told(neighbours, told):
    """Faults caught: peak-to-peaks of means that pass for those of samples; told where every sample is a row."""
    said = compensate._averaged(neighbours)
    assert any(f"{neighbours} samples each are averaged" in one for one in said) is told
