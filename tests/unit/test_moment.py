"""The moment that files bear: the environment's, or the present."""

import datetime

import pytest

from hdopt.cli import main
from hdopt.errors import HdoptError
from hdopt.moment import moment


@pytest.mark.parametrize("given", ["12a", "-5", "1.5", " 7", "9" * 40, "١٢", "253402300800", "nan"])
def test_a_moment_that_cannot_be_is_refused_before_any_work(monkeypatch, capsys, given):
    """Would catch digits of other scripts, a year past 9999, and one that is passed over for the present."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", given)
    with pytest.raises(HdoptError, match="SOURCE_DATE_EPOCH is .* whole seconds since"):
        moment()
    with pytest.raises(SystemExit) as ended:
        main(["ke"])
    out, err = capsys.readouterr()
    assert ended.value.code == 2 and not out and "SOURCE_DATE_EPOCH" in err


def test_the_environments_moment_is_in_utc(monkeypatch):
    """Would catch local time: the second before midnight of the last day that has four digits of a year."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "253402300799")
    assert moment() == datetime.datetime(9999, 12, 31, 23, 59, 59, tzinfo=datetime.UTC)


def test_without_one_it_is_the_present(monkeypatch):
    for given in (None, ""):
        if given is None:
            monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
        else:
            monkeypatch.setenv("SOURCE_DATE_EPOCH", given)
        assert abs(datetime.datetime.now(datetime.UTC) - moment()) < datetime.timedelta(minutes=1)
