# The two commands: `make study` runs the main studies, `make test` runs every test in a fresh environment.
PYTHON ?= python3
VENV := .venv
TEST_VENV := build/test-environment
OUT ?= out
SHIPPED := csf-25-80 paper-reproduction csf-25-80-design-trade

.PHONY: study test check lint lock benchmark clean

study: $(VENV)/ready
	for study in $(SHIPPED); do $(VENV)/bin/hdopt run $$study -o $(OUT)/$$study || exit 1; done

test:
	rm -rf $(TEST_VENV)
	$(MAKE) $(TEST_VENV)/ready VENV=$(TEST_VENV)
	$(TEST_VENV)/bin/ruff check .
	$(TEST_VENV)/bin/python -m pytest -n 2 --benchmark-disable $(PYTEST_ARGS)

check: $(VENV)/ready lint
	$(VENV)/bin/python -m pytest -q -m "not slow and not browser" --benchmark-disable -x -n 2 $(PYTEST_ARGS)

lint: $(VENV)/ready
	$(VENV)/bin/ruff check .

benchmark: $(VENV)/ready
	$(VENV)/bin/python -m pytest tests/benchmarks --benchmark-only

lock:
	uv pip compile --universal --python-version 3.11 --all-extras pyproject.toml --upgrade \
		--no-header --no-annotate -o requirements.lock

clean:
	rm -rf $(VENV) build dist $(OUT) *.egg-info

$(VENV)/ready: requirements.lock pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	touch $@
