"""hdopt: design optimization and tolerancing for harmonic drives (strain wave gears)."""
