"""Steps about tolerances: what they give, which of them matter, what they should be."""

from __future__ import annotations

from hdopt import tolerancing
from hdopt.report import Section, Text
from hdopt.report.sections.tolerances import allocate_section, sobol_section, stack_section
from hdopt.steps import StepResult
from hdopt.study import Study
from hdopt.tolerance.allocate import Infeasible


def stack(study: Study, seed: int) -> StepResult:
    """Monte Carlo stack with its worst case."""
    result = tolerancing.stack(study, worst_case=True, seed=seed)
    return StepResult((stack_section(result),), result.to_dict())


def sobol(study: Study, seed: int) -> StepResult:
    """Sobol' indices of inputs, groups and pairs, or Shapley effects."""
    result = tolerancing.sobol(study, seed=seed)
    return StepResult((sobol_section(result),), result.to_dict())


def allocate(study: Study, seed: int) -> StepResult:
    """Least-cost tolerances by the study's rule, beside the other rules."""
    try:
        result = tolerancing.allocate(study, seed=seed)
    except Infeasible as error:
        section = Section("allocate", "What the tolerances should be", (Text(str(error)),), "No tolerances are enough.")
        return StepResult((section,), {"status": "infeasible", "reason": str(error)})
    return StepResult((allocate_section(result),), result.to_dict())
