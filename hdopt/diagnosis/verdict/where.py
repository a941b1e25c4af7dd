"""Where something lives: the `where` of the JSON contract."""

from __future__ import annotations

from typing import NotRequired, TypedDict


class Where(TypedDict):
    """Domain, orders (cycles an input turn), direction, share of the residual's power (0 to 1) and rms; of what changes
    in time also its period (s), or how many sudden steps there are; of what comes and goes the spread of its size from
    one input turn to the next, over its mean; of what is new each turn at one angle of the input that angle.
    """

    domain: str
    orders_per_input_turn: list[float]
    direction: str
    share_of_residual: float
    rms_arcmin: float
    period_s: NotRequired[float]
    sudden_steps: NotRequired[int]
    spread_over_turns: NotRequired[float]
    input_angle_deg: NotRequired[float]
