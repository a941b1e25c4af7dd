"""Kinematic error of a drive after Jia et al. 2021: geometry of the deepest points, waveform, peak-to-peak, lag.

Symbols, signs and zeros are those of docs/conventions.md. Input angles theta are in rad, clockwise.
"""

from hdopt.kinematics.peak_to_peak import peak_to_peak_arcmin
from hdopt.kinematics.waveform import full_turn, kinematic_error_arcmin, zone_deviation

__all__ = ["full_turn", "kinematic_error_arcmin", "peak_to_peak_arcmin", "zone_deviation"]
