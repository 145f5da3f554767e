# Everything a newcomer or CI types. Needs only Python 3.11+, make and git; all it makes stays in this folder.
SHELL := /bin/bash
PYTHON ?= $(firstword $(foreach p,python3.11 python3.12 python3.13 python3,$(shell command -v $(p) 2>/dev/null)))
VENV := .venv
BIN := $(VENV)/bin
CODE := mavplan sitl_mock tests benchmarks missions docs
PYTEST_ARGS ?=
# MAVSDK, MAVProxy and others keep caches below the home folder: while our programs run, that one is in here.
AT_HOME_HERE = mkdir -p .cache/home && HOME="$(CURDIR)/.cache/home"
# A virtual environment of the caller's must not leak into ours, nor caches out of this folder.
unexport PYTHONPATH VIRTUAL_ENV PYTHONHOME
export MPLCONFIGDIR := $(CURDIR)/.cache/matplotlib
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.DEFAULT_GOAL := help
.PHONY: help demo test test-vehicle check format lint types docs bench lock clean

help:  ## what can be typed here
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 16

$(VENV)/ready: requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "no Python found: install Python 3.11, or say make PYTHON=/path/to/python3.11"; exit 2; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "$(PYTHON) is older than Python 3.11: say make PYTHON=/path/to/python3.11"; exit 2; }
	@test -x $(BIN)/python || "$(PYTHON)" -m venv $(VENV)
	@echo "installing the locked packages into $(VENV) (a few minutes the first time) ..."
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

demo: $(VENV)/ready  ## a valley without network: plan, files, upload to a mock vehicle, read-back
	$(AT_HOME_HERE) $(BIN)/mavplan demo missions/valley/scenario.toml --out out/demo

test: $(VENV)/ready lint types  ## format, lint, strict types and all tests
	$(AT_HOME_HERE) $(BIN)/python -m pytest -n auto --basetemp=.cache/pytest $(PYTEST_ARGS)

test-vehicle: $(VENV)/ready  ## fly the gallery on the vehicle at CONN=udp:0.0.0.0:14550; SIM=1: a simulator, do not ask
	$(AT_HOME_HERE) CONN="$(CONN)" SIM="$(SIM)" SCENARIOS="$(SCENARIOS)" $(BIN)/python -m pytest -p no:xdist -q tests/vehicle

check: test  ## the same as test

lint: $(VENV)/ready
	$(BIN)/ruff format --check --quiet $(CODE) || { echo "run: make format"; exit 1; }
	$(BIN)/ruff check --quiet $(CODE)

types: $(VENV)/ready
	$(BIN)/mypy

format: $(VENV)/ready  ## put the code in its format
	$(BIN)/ruff check --quiet --fix $(CODE); $(BIN)/ruff format --quiet $(CODE)

docs: $(VENV)/ready  ## the documentation as a site, in out/docs; warnings are errors
	$(BIN)/python -m sphinx -W --keep-going -q -b html -d .cache/doctrees docs out/docs

bench: $(VENV)/ready  ## time what users wait for
	$(AT_HOME_HERE) $(BIN)/python -m benchmarks

lock: $(VENV)/ready  ## write requirements.lock anew from pyproject.toml
	$(PYTHON) -m venv .cache/uv && .cache/uv/bin/pip install --quiet uv
	.cache/uv/bin/uv --cache-dir .cache/uv-cache pip compile pyproject.toml --all-extras --universal \
	  --generate-hashes --no-emit-index-url --python-version 3.11 --no-header --quiet -o requirements.lock

clean:  ## remove all that make has made
	rm -rf $(VENV) .venv-mavproxy .cache .mypy_cache .pytest_cache .ruff_cache .hypothesis out dist
