"""Where the drive stood when its input angle was read: an encoder that reads it wrong moves all that is met.

An input encoder whose error is e(theta) shows e/N of it at the output, and the drive stands at theta - e where theta is
read. An error of 0.1 arcmin at the output is 0.1 N arcmin at the input, 5 mrad at N = 160: nothing to a wave an input
turn, but a third of the width of a damaged tooth's pulse, and 90 deg of a ripple that has 322 waves. What is fitted at
the angles as read comes out too small, and the drive's own errors bend to make up for it. An input that is read
before the output or after it, at the speed it has, is read wrong by as much in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.catalogue import properties_of
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.term import Term
from hdopt.recordings.rows import Rows


def reads_input(term: Term) -> bool:
    """Whether `term` is an error of the input angle as it is read."""
    return properties_of(term.effect).reads_input(term.shape)


def read_ahead(rows: Rows, terms: Sequence[Term], coefficients: Sequence[Array]) -> Array | None:
    """By how much the input angle of `rows` is read ahead of where the drive stood, rad at the input, (n,), as those of
    `terms` with their `coefficients` say that are errors of its reading; None without one.
    """
    ahead: Array | None = None
    for term, c in zip(terms, coefficients, strict=True):
        if term.columns is not None and np.any(c) and reads_input(term):
            own = term.columns @ c
            ahead = own if ahead is None else ahead + own
    return None if ahead is None else ARCMIN * rows.ratio * ahead


def where_it_stood(rows: Rows, ahead: Array | None) -> Rows:
    """`rows` at the input angles at which the drive stood, where these were read `ahead` (n,) of it, rad (None:
    nowhere). The angles as read are kept beside them: by these an encoder's own lines go.
    """
    return rows if ahead is None else replace(rows, theta=rows.theta - ahead, input_read=rows.input_as_read)
