"""The shipped studies, the steps that only they need, and the sections that those steps bring to a study file."""

SECTIONS = {
    "concealed": "hdopt.studies.sections:ConcealedSection",
    "residuals": "hdopt.studies.sections:ResidualsSection",
}
"""Section -> where its model is."""
