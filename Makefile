# Everything a fresh machine needs is here: Python 3.11 to 3.13, make, and the package registries.
PYTHON ?= python3
VENV ?= .venv
WORKERS ?= 2
BIN := $(VENV)/bin

# More BLAS threads than cores make two test workers slower, not faster.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1

.PHONY: help demo study browser test lint types docs format clean
.NOTPARALLEL:

help:
	@echo "make demo    install braidcast in $(VENV) and simulate examples/success.toml into demo/"
	@echo "make study   install and simulate the 900 cases of the study, or what is missing of them"
	@echo "make test    install and run the tests"
	@echo "make browser install the browser that the tests of the planner drive, if there is none"
	@echo "make lint    ruff: rules and layout"
	@echo "make types   mypy"
	@echo "make docs    Sphinx: the site, from docs/ into docs/_build/html"
	@echo "make format  let ruff lay the sources out"
	@echo "make clean   remove $(VENV), demo/ and caches"

demo: $(VENV)/.installed-pictures
	$(BIN)/braidcast simulate examples/success.toml -o demo

study: $(VENV)/.installed-test
	$(BIN)/python study/rebuild.py

# The system's Chromium, installed where that is allowed; else Playwright's own.
browser: $(VENV)/.installed-test
	@for name in chromium chromium-browser google-chrome; do \
	    if command -v $$name >/dev/null; then exit 0; fi; \
	done; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y chromium && exit 0; \
	fi; \
	$(BIN)/python -m playwright install chromium

test: $(VENV)/.installed-test browser
	$(ONE_THREAD) $(BIN)/python -m pytest -q -n $(WORKERS) --dist worksteal

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.installed-dev
	$(BIN)/mypy

docs: $(VENV)/.installed-docs
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html

format: $(VENV)/.installed-dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) demo docs/_build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' || { \
	    echo "braidcast needs Python 3.11 to 3.13; say which with: make $(MAKECMDGOALS) PYTHON=python3.12" >&2; \
	    exit 1; }
	$(PYTHON) -m venv $(VENV)

# A stamp for each set of extras: installed again only when pyproject.toml changes.
$(VENV)/.installed-%: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet -e ".[$*]"
	@touch $@

.PRECIOUS: $(VENV)/.installed-%
