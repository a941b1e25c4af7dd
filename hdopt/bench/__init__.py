"""Blind cases: recordings of a simulated bench with physics concealed in them, and the scorer of the answers.

The bench is a second statement of the physics, in the time domain and without a line of hdopt (a test reads the
imports), so that a diagnosis cannot pass by agreeing with itself. A proof takes three steps, the truth sealed between:

    python -m hdopt.bench.generate --out DIR --seed S [--families ...] [--cases 100] [--workers 2]
    python -m hdopt.bench.answer --dir DIR [--workers 2] -- hdopt diagnose
    python -m hdopt.bench.score --dir DIR

A run that others should believe is entered into the register before it has a seed: `register` lists its steps, `page`
writes docs/proof.md of all runs, `baselines` answer the same cases.

From Python: `suite.plan(seed)` gives specs, `cases.generate(spec)` a case (tables) and its key, `score.score(answers,
keys)` the scores, `proof.prove(diagnose, seed, share=0.05)` all three steps; `thresholds` holds the gate. From a motion
to a file: `motion` (what the motor does), `signal_chain` (the bench, and the stages at which `hidden_*` physics acts),
`instrument` (noise, resolution, gaps). `evidence` says of each case whether its records could decide at all: the key's
`margin`, `detectable` and `rivals`.
"""

import os

# The matrices here are small and many: threads would spend their time waiting for each other. Takes hold where numpy is
# not loaded yet, which is so in the commands above.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
