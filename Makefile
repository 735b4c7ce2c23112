# SPDX-License-Identifier: BSD-3-Clause
# make demo | story | docs | test | test-all | lint | bench | bench-arms | bench-discovery | bench-estimator | bench-real | fuzz | pythons | clean
# Everything lives in .venv; a second run installs only what changed.

SUITABLE := import sys; sys.exit(sys.version_info < (3, 11))
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11; do \
	$$p -c '$(SUITABLE)' >/dev/null 2>&1 && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
SOURCES := $(shell find robots factors graphs tools -type f -not -path '*/__pycache__/*')
TYPES := build/types

.PHONY: demo docs story test test-all lint style types bench bench-arms bench-discovery bench-estimator bench-real bench-tx90l bench-biorob fuzz pythons clean
.NOTPARALLEL:

demo: $(VENV)/sim $(VENV)/code
	$(BIN)/jointscope demo -o demo

# The picture of the README and its figures in docs/measured.md: three effects are hidden, a quarter of an hour.
story: $(VENV)/sim $(VENV)/code
	$(BIN)/python benchmarks/bench_story.py

# One process a core, each with one thread of linear algebra; a file's tests stay together, as they share recordings.
PYTEST := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses auto --dist loadfile

# Without what is marked slow: some minutes.
test: $(VENV)/dev $(VENV)/code
	$(PYTEST) -m "not slow"

test-all: $(VENV)/dev $(VENV)/code
	$(PYTEST)

lint: style types

style: $(VENV)/dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check

# mypy sees the rooms as one package through links.
types: $(VENV)/dev
	rm -rf $(TYPES) && mkdir -p $(TYPES)/jointscope
	ln -s $(addprefix $(CURDIR)/,robots factors graphs tools tools/facade/__init__.py tools/facade/py.typed) $(TYPES)/jointscope/
	cd $(TYPES) && $(CURDIR)/$(BIN)/mypy --config-file $(CURDIR)/pyproject.toml --cache-dir $(CURDIR)/.mypy_cache -p jointscope

# Pages with pictures and search in build/site; fails where a link leads nowhere. Nothing in them asks the internet.
docs: $(VENV)/dev $(VENV)/code
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet docs build/site
	@echo "Open build/site/index.html"

bench: $(VENV)/bench $(VENV)/code
	$(BIN)/python benchmarks/bench.py

# About an hour; an interrupted run continues. Eight robots: .venv/bin/python benchmarks/bench_arms.py --quick
bench-arms: $(VENV)/bench $(VENV)/code
	$(BIN)/python benchmarks/bench_arms.py

# A quarter of an hour on a machine that has nothing else to do; with --quick two minutes.
bench-estimator: $(VENV)/bench $(VENV)/code
	$(BIN)/python benchmarks/bench_estimator.py

# Hours; an interrupted run continues. A tenth: .venv/bin/python benchmarks/bench_discovery.py --quick
bench-discovery: $(VENV)/bench $(VENV)/code
	$(BIN)/python benchmarks/bench_discovery.py

# Needs the recordings in ../shared/data/real; says so and ends where they are missing.
bench-real: $(VENV)/bench $(VENV)/code
	$(BIN)/python benchmarks/bench_real.py

bench-tx90l: $(VENV)/sim $(VENV)/code
	$(BIN)/python benchmarks/bench_tx90l.py
	$(BIN)/python benchmarks/bench_tx90l.py kinds
	$(BIN)/python benchmarks/bench_tx90l.py search
	$(BIN)/python benchmarks/bench_tx90l.py coverage
	$(BIN)/python benchmarks/bench_tx90l.py ways
	$(BIN)/python benchmarks/bench_tx90l.py systems

bench-biorob: $(VENV)/code
	$(BIN)/python benchmarks/bench_biorob.py

# Below an hour; fails where something is found.
fuzz: $(VENV)/sim $(VENV)/code
	$(BIN)/python benchmarks/fuzz_bags.py

# The wheel in an empty environment of each Python: the demo must find the hidden effect. Those that are missing are said.
PYTHONS ?= python3.11 python3.12 python3.13
pythons: $(VENV)/made
	rm -rf build/pythons && mkdir -p build/pythons/wheel
	$(PIP) wheel --no-deps --wheel-dir build/pythons/wheel .
	@for p in $(PYTHONS); do \
		$$p -c '$(SUITABLE)' >/dev/null 2>&1 || { echo "$$p: not on this machine"; continue; }; \
		d=$(CURDIR)/build/pythons/$$(basename $$p); \
		$$p -m venv $$d && $$d/bin/python -m pip --disable-pip-version-check --quiet install "$$(echo build/pythons/wheel/*.whl)[sim,plot]" \
		&& (cd $$d && bin/jointscope demo > demo.txt) && echo "$$($$d/bin/python --version): $$(grep 'was found' $$d/demo.txt)" || exit 1; \
	done

clean:
	rm -rf $(VENV) build demo *.egg-info .mypy_cache .pytest_cache .ruff_cache

$(VENV)/made:
	@test -n "$(PYTHON)" && $(PYTHON) -c '$(SUITABLE)' || { \
		echo "jointscope needs Python 3.11 or newer, and none was found; install it, or name one: make PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
		echo "$(PYTHON) cannot make virtual environments; on Debian and Ubuntu: apt install python3-venv"; exit 1; }
	rm -rf $(VENV) && $(PYTHON) -m venv $(VENV)
	$(PIP) install "pip>=24" "setuptools>=77"
	touch $@

# Dependencies; pyproject.toml says which.
$(VENV)/sim $(VENV)/dev $(VENV)/bench: $(VENV)/made pyproject.toml
	@echo "Installing into $(VENV): about 1.5 GB the first time, some minutes"
	rm -rf build
	$(PIP) install --no-build-isolation ".[$(notdir $@)]"
	touch $@

# The package itself, again after each change; without build/, where removed modules would live on.
$(VENV)/code: $(VENV)/made $(SOURCES) pyproject.toml setup.py
	rm -rf build
	$(PIP) install --no-build-isolation --no-deps --force-reinstall .
	touch $@
