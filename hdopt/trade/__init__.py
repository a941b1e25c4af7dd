"""Design search: which profile, structure, pressure angle, width, module and deflection, and what each of them costs.

Variables and choices (`space`) make drives; quantities of drives (`quantities`, from the physics and from `mesh` and
`bearing`) are minimised or limited by NLopt (`nlopt_guard`, `minimax`); fronts come from repeated limited searches.
"""

from hdopt.trade.run import SearchResult, search

__all__ = ["SearchResult", "search"]
