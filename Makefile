# `make compare` runs the main study, `make test` the tests, and `make test-all` the slow ones, too, with a million maps
# against Dijkstra; all create .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: install compare test test-all lint bench clean

$(VENV)/installed: pyproject.toml
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(None if v >= (3, 11) else "jaxbiped needs Python 3.11 or later; this is %d.%d. Set PYTHON=python3.12, say." % v[:2])'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[test,bench]'
	touch $@

install: $(VENV)/installed

compare: install
	$(BIN)/jaxbiped compare configs/studies/compare.toml

test: install
	$(BIN)/python -m pytest -m "not slow" -n 2

test-all: install
	$(BIN)/python -m pytest -n 2
	$(BIN)/python -m tests.planning.million

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

bench: install
	$(BIN)/python sweeps/bench_planning.py
	$(BIN)/python sweeps/bench_mapping.py
	$(BIN)/python sweeps/bench_mission.py

clean:
	rm -rf $(VENV) results build *.egg-info
