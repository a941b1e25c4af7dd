"""What a study's [tolerances] allow a drive's errors to be: a diagnosis says where a fitted drive lies outside them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hdopt.drive.errors import study_key
from hdopt.study import Study

if TYPE_CHECKING:
    from hdopt.diagnosis.settings import DiagnosisSettings


def with_tolerances_of(study: Study | None, settings: DiagnosisSettings | None) -> DiagnosisSettings:
    """The diagnosis's `settings` (None: as shipped) with the tolerances that `study` states; as they are where there is
    no study, or it states none.
    """
    from hdopt.diagnosis.settings import DEFAULT

    settings = DEFAULT if settings is None else settings
    if study is None:
        return settings
    stated = tuple(sorted(stated_tolerances(study).items()))
    return replace(settings, base=replace(settings.base, stated_tolerances=stated)) if stated else settings


def stated_tolerances(study: Study) -> dict[str, float]:
    """The largest size of each error that [tolerances] of `study` allow, by the error's key, in its unit (mm, deg): the
    bound of its distribution, or where that has none what 99.73 % of drives keep. Errors that [contributors] add to
    are left out: their rows are not all that is allowed.

    Raises `HdoptError` where a row of [tolerances] cannot be used.
    """
    from hdopt.diagnosis.inference.base_fit import SIZES
    from hdopt.study.tolerances import NEARLY_ALL, ContributorsSection, TolerancesBase, vector_of
    from hdopt.tolerance.contributors import VECTORS

    section = study.find("tolerances", TolerancesBase)
    if section is None:
        return {}
    contributors = study.find("contributors", ContributorsSection)
    rows = {} if contributors is None else contributors.rows
    added = {study_key(part) for row in rows.values() for part in VECTORS[vector_of(row.feeds)][1:]}
    found = {}
    for name, distribution in section.distributions(study.folder).items():
        if name not in SIZES or name in added:
            continue
        ends = distribution.support
        if not all(map(math.isfinite, ends)):
            ends = tuple(distribution.quantile(np.array(NEARLY_ALL)))
        if (largest := float(max(map(abs, ends)))) > 0:
            found[name] = largest
    return found
