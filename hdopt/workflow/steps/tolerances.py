"""Steps about tolerances: what they give, which of them matter, what they should be."""

from __future__ import annotations

from hdopt.allocation.convex import Infeasible
from hdopt.report import Section, Text
from hdopt.report.sections.tolerances import allocate_section, sobol_section, stack_section
from hdopt.study import Study
from hdopt.workflow import allocate as allocation
from hdopt.workflow import stack as tolerancing
from hdopt.workflow.steps import Context, StepResult


def stack(study: Study, context: Context) -> StepResult:
    """Monte Carlo stack of the `study` with its worst case; `context` gives the seed."""
    result = tolerancing.stack(study, worst_case=True, seed=context.seed)
    return StepResult((stack_section(result),), result.to_dict())


def sobol(study: Study, context: Context) -> StepResult:
    """Sobol' indices of the inputs of a `study`, groups and pairs, or Shapley effects; `context` gives the seed."""
    result = tolerancing.sobol(study, seed=context.seed)
    return StepResult((sobol_section(result),), result.to_dict())


def allocate(study: Study, context: Context) -> StepResult:
    """Least-cost tolerances by the rule of the `study`, beside the other rules; `context` gives the seed."""
    try:
        result = allocation.allocate(study, seed=context.seed)
    except Infeasible as error:
        section = Section("allocate", "What the tolerances should be", (Text(str(error)),), "No tolerances are enough.")
        return StepResult((section,), {"status": "infeasible", "reason": str(error)}, answer=False)
    return StepResult((allocate_section(result),), result.to_dict(), answer=result.accepted)
