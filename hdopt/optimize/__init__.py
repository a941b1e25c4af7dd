"""Design search: which profile, structure, pressure angle, width, module and deflection, and what each of them costs.

Variables and choices (`design_space`) make drives; quantities of drives (`objectives`, from the physics) are minimised
or limited by NLopt (`nlopt_adapter`, `minimax`); fronts come from repeated limited searches.
"""
