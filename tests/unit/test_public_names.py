"""What `import hdopt` offers: every name is there, a version, and calls that take records, names and studies alike."""

import ast
import importlib.metadata
from pathlib import Path

import pytest

import hdopt


def test_every_public_name_is_there():
    missing = [name for name in hdopt.__all__ if getattr(hdopt, name, None) is None]
    assert not missing
    assert hdopt.__version__ == importlib.metadata.version("hdopt")


def test_kinematic_error_of_records_of_a_name_and_of_a_study_are_one():
    study = hdopt.load_study("csf-25-80")
    by_study = hdopt.kinematic_error(study)
    by_name = hdopt.kinematic_error("csf-25-80")
    by_records = hdopt.kinematic_error(study.drive, study.errors)
    assert by_study.to_dict() == by_name.to_dict()
    assert by_records.to_dict() | {"study": "csf-25-80"} == by_study.to_dict()
    assert hdopt.profile("csf-25-80") == hdopt.profile(study)
    without = hdopt.kinematic_error(study.drive)
    assert without.peak_to_peak_arcmin < by_study.peak_to_peak_arcmin


def test_errors_beside_a_study_are_refused():
    with pytest.raises(hdopt.HdoptError, match=r"change them with study\.with_"):
        hdopt.kinematic_error("csf-25-80", hdopt.DriveErrors())


def test_type_checkers_see_the_same_names():
    """`import hdopt` is lazy; the imports under TYPE_CHECKING must name the same things from the same modules."""
    tree = ast.parse(Path(hdopt.__file__).read_text())
    (block,) = [node for node in tree.body if isinstance(node, ast.If)]
    seen = {alias.name: node.module for node in block.body for alias in node.names}
    assert all(alias.asname == alias.name for node in block.body for alias in node.names)
    assert seen == hdopt._EXPORTS
