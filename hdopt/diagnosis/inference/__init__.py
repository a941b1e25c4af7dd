"""Fits of models to recordings: noise, held-out error, and what may enter a fit."""
