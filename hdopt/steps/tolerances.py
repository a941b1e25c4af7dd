"""Steps about tolerances: what they give, which of them matter, what they should be."""

from __future__ import annotations

from hdopt import allocation, tolerancing
from hdopt.report import Section, Text
from hdopt.report.sections.tolerances import allocate_section, sobol_section, stack_section
from hdopt.steps import Context, StepResult
from hdopt.study import Study
from hdopt.tolerance.allocate import Infeasible


def stack(study: Study, context: Context) -> StepResult:
    """Monte Carlo stack with its worst case."""
    result = tolerancing.stack(study, worst_case=True, seed=context.seed)
    return StepResult((stack_section(result),), result.to_dict())


def sobol(study: Study, context: Context) -> StepResult:
    """Sobol' indices of inputs, groups and pairs, or Shapley effects."""
    result = tolerancing.sobol(study, seed=context.seed)
    return StepResult((sobol_section(result),), result.to_dict())


def allocate(study: Study, context: Context) -> StepResult:
    """Least-cost tolerances by the study's rule, beside the other rules."""
    try:
        result = allocation.allocate(study, seed=context.seed)
    except Infeasible as error:
        section = Section("allocate", "What the tolerances should be", (Text(str(error)),), "No tolerances are enough.")
        return StepResult((section,), {"status": "infeasible", "reason": str(error)}, answer=False)
    return StepResult((allocate_section(result),), result.to_dict(), answer=result.accepted)
