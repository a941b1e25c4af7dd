"""What a machine may lack that some tests need; without it they are skipped, visibly."""

import multiprocessing

import pytest


def gives_semaphores() -> bool:
    """Whether processes can wait for each other here: it takes a /dev/shm that can be written."""
    try:
        multiprocessing.get_context("spawn").Lock()
    except (OSError, ImportError):
        return False
    return True


needs_semaphores = pytest.mark.skipif(
    not gives_semaphores(), reason="no semaphores: processes that share work need a /dev/shm that can be written"
)
