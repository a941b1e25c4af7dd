"""A changed study without its file: `Study.with_`, and the keys that --set knows."""

import pytest

import hdopt
from hdopt.errors import HdoptError


def test_a_changed_study_equals_one_loaded_with_the_change():
    study = hdopt.load_study("csf-25-80-tolerances")
    changed = study.with_({"axis_tilt_y_deg.std": 0.05}, width_mm=8.0)
    loaded = hdopt.load_study("csf-25-80-tolerances", ["axis_tilt_y_deg.std=0.05", "width_mm=8.0"])
    assert changed.data == loaded.data
    assert changed.sections == loaded.sections
    assert changed.drive == loaded.drive
    assert study.drive.wave_generator.width == 9.0


def test_a_changed_study_is_checked_like_a_file():
    study = hdopt.load_study()
    with pytest.raises(HdoptError, match=r"study.with_ unknown key 'widht_mm'; .*'width_mm'"):
        study.with_(widht_mm=8.0)
    with pytest.raises(HdoptError, match=r"width_mm: is -1\.0; it must be greater than or equal to 0\.1"):
        study.with_(width_mm=-1.0)


@pytest.mark.parametrize(
    ("override", "path"),
    [
        ("search.trade.friction=0.1", ("search", "trade", "friction")),
        ("search.perturbation=0.1", ("search", "perturbation")),
        ("search.limits.flank_pressure_mpa.max=200.0", None),
        ("tolerances.fs_tooth_amplitude_mm.cost.widest=0.01", None),
        ("axis_tilt_y_deg.mean=0.01", ("tolerances", "axis_tilt_y_deg", "mean")),
        ("export.bore_mm=8.0", ("export", "bore_mm")),
    ],
)
def test_every_key_of_the_schema_can_be_set(override, path):
    try:
        study = hdopt.load_study(None, [override])
    except HdoptError as error:
        # known to the schema: refused, if at all, for what is missing beside it, not as an unknown key
        assert path is None and "unknown key" not in str(error)
        return
    value = study.data
    for part in path or ():
        value = value[part]
    assert path is None or value == float(override.partition("=")[2])


def test_an_unwritten_key_of_a_tolerance_can_be_set():
    # 'upper' of a normal tolerance that the file leaves without bounds
    study = hdopt.load_study().with_({"tolerances.axis_tilt_y_deg": {"distribution": "normal", "std": 0.05}})
    assert "upper" not in study.data["tolerances"]["axis_tilt_y_deg"]
    assert study.with_({"axis_tilt_y_deg.upper": 0.1}).sections["tolerances"].axis_tilt_y_deg.upper == 0.1


def test_a_kind_of_table_has_only_its_own_keys():
    with pytest.raises(HdoptError, match="unknown key 'axis_tilt_y_deg.scale'"):
        hdopt.load_study().with_({"axis_tilt_y_deg.scale": 0.1})
