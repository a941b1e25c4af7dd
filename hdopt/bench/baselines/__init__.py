"""Plain methods that answer the same cases: what a diagnosis has to beat.

Each is a function from a case's recordings (tables) and the gear's ratio to an answer by the contract. None knows the
drive's model; all take what its known orders can hold as their base. `METHODS` lists them.
"""

from hdopt.bench.baselines.gaussian_process import gaussian_process
from hdopt.bench.baselines.generic_basis import generic_basis
from hdopt.bench.baselines.order_spectrum import order_spectrum
from hdopt.bench.baselines.sparse_regression import sparse_regression

METHODS = {
    "order spectrum": order_spectrum,
    "sparse regression": sparse_regression,
    "gaussian process": gaussian_process,
    "generic basis": generic_basis,
}
