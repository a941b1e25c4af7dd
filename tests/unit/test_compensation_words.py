"""What a compensation says of itself beside its numbers."""

from types import SimpleNamespace

import pytest

from hdopt.workflow.compensate import VOID, VOID_OF_STRAIN_WAVE, Compensated


@pytest.mark.parametrize(("strain_wave", "said"), [(True, VOID_OF_STRAIN_WAVE), (False, VOID)])
def test_only_a_harmonic_drive_has_a_wave_generator_to_take_out(strain_wave, said):
    """Faults caught: a planetary gear told that its circular spline may have been turned; a gear that may be taken
    apart and keep its table."""
    made = SimpleNamespace(strain_wave=strain_wave)
    assert Compensated.void.fget(made) == said
    assert ("wave generator" in said) is strain_wave
    assert ("the gear was taken apart" in said) is not strain_wave
    assert "encoder or its zero" in said and "load or temperature" in said
