"""Blind cases: recordings of a simulated bench with physics concealed in them, and the scorer of the answers.

Nothing in this package but the tests' own files may import `hdopt`: the bench is a second, independent statement of the
physics, so that a diagnosis cannot pass by agreeing with itself.
"""
