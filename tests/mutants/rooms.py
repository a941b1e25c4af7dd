"""The rooms of which mechanical mutants are counted, and the share that must be killed."""

ROOMS = {
    "kinematics": 0.90,
    "mechanics": 0.90,
    "tolerance": 0.90,
    "effects": 0.90,
    "recordings": 0.90,
    "diagnosis": 0.85,
    "allocation": 0.90,
    "compensation": 0.90,
    "drive": 0.90,
    "optimize": 0.90,
    "simulation": 0.90,
    "study": 0.90,
    "workflow": 0.90,
}
