# The two commands: `make study` runs the main studies, `make test` runs every test in a fresh environment.
PYTHON ?= python3
VENV := .venv
TEST_VENV := build/test-environment
OUT ?= out
SHIPPED := csf-25-80 paper-reproduction csf-25-80-design-trade

# Without compiled modules every process spends some 3 s more on its imports.
unexport PYTHONDONTWRITEBYTECODE

# `docs` is a folder too, which would else count as made.
.PHONY: install study test every-test check lint types lock docs benchmark fuzz mutants faults clean

# hdopt alone, without a study.
install: $(VENV)/ready

study: $(VENV)/ready
	for study in $(SHIPPED); do $(VENV)/bin/hdopt run $$study -o $(OUT)/$$study || exit 1; done

test:
	rm -rf $(TEST_VENV)
	$(MAKE) $(TEST_VENV)/ready-to-test VENV=$(TEST_VENV)
	$(TEST_VENV)/bin/ruff check .
	$(MAKE) -j 2 types every-test VENV=$(TEST_VENV)

# Beside the types, which take a minute on one core where nothing of them is known yet. First the kernels, which all
# other tests load then: what two workers meet before it is compiled, either compiles for itself.
every-test:
	$(VENV)/bin/python -m pytest -q -n 2 -m compiles tests/unit/test_compiled_kernels.py
	$(VENV)/bin/python -m pytest -n 2 --dist worksteal -m "not measurement and not compiles" --benchmark-disable $(PYTEST_ARGS)

check: lint types
	$(VENV)/bin/python -m pytest -q -m "not slow and not timed and not browser and not measurement" --benchmark-disable -x -n 2 $(PYTEST_ARGS)

lint: $(VENV)/ready-to-test
	$(VENV)/bin/ruff check .

# The packages as they are installed: hdopt.geometry and hdopt.studies lie in folders of their own.
types: $(VENV)/ready-to-test
	rm -rf build/types && mkdir -p build/types/hdopt
	ln -s $(CURDIR)/hdopt/* $(CURDIR)/geometry $(CURDIR)/studies build/types/hdopt/
	cd build/types && $(abspath $(VENV))/bin/mypy --config-file $(CURDIR)/pyproject.toml --cache-dir $(CURDIR)/.mypy_cache -p hdopt

fuzz: $(VENV)/ready-to-test
	$(VENV)/bin/python -m tests.fuzz.soak --out build/fuzz $(FUZZ_ARGS)

# Faults put in one at a time: which do the tests notice? Hours; continues where it stopped. MUTANTS="mechanics --sample 40"
mutants: $(VENV)/ready-to-test
	$(VENV)/bin/python -m tests.mutants $(MUTANTS)

# Those made by hand, an hour for all: docs/mutants.md. FAULTS="diagnosis"
faults: $(VENV)/ready-to-test
	$(VENV)/bin/python -m tests.mutants.faults $(FAULTS)

# The site in build/site; a warning is an error. HDOPT_DOCS_PICTURES=0: without the pictures of the gallery.
docs: $(VENV)/ready-to-test
	$(VENV)/bin/python -m sphinx -W --keep-going -b html docs build/site

benchmark: $(VENV)/ready-to-test
	$(VENV)/bin/python -m tests.benchmarks.page
	mkdir -p build
	$(VENV)/bin/python -m pytest tests/benchmarks --benchmark-only --benchmark-json build/benchmark.json
	$(VENV)/bin/python -m tests.benchmarks.ratios build/benchmark.json docs/verification.md

# What `hdopt` needs to run, and what its tests need besides, at the same versions.
LOCK := uv pip compile --universal --python-version 3.11 --no-header --no-annotate pyproject.toml
lock:
	$(LOCK) --upgrade -o requirements.lock
	$(LOCK) --upgrade --all-extras -c requirements.lock -o requirements-test.lock

clean:
	rm -rf $(VENV) build dist $(OUT) *.egg-info

# uv unpacks packages side by side; where it does not reach them (a mirror that only pip knows), pip does.
PIP = $(VENV)/bin/python -m pip install --quiet --disable-pip-version-check
INSTALL = $(VENV)/bin/uv pip install --python $(VENV)/bin/python
$(VENV)/ready: requirements.lock requirements-test.lock pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(PIP) -c requirements-test.lock uv
	$(INSTALL) -r requirements.lock || $(PIP) -r requirements.lock
	$(PIP) --no-deps -e .
	touch $@

$(VENV)/ready-to-test: $(VENV)/ready requirements-test.lock
	$(INSTALL) -r requirements-test.lock || $(PIP) -r requirements-test.lock
	touch $@
