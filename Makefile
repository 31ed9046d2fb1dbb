SHELL := /bin/bash
# The environment, and what makes it: make check VENV=.venv-3.10 PYTHON=3.10
VENV ?= .venv
export VENV PYTHON
BIN := $(VENV)/bin
# As many workers as test/conftest.py finds use for, but no more than memory has room for. Tests of one
# file share what it has started; files whose tests start processes take longest, and come first.
PYTEST := $(BIN)/python -m pytest -n auto --maxprocesses 8 --dist loadfile --no-loadscope-reorder

# Without bytecode every process that a test starts would compile all sources again.
unexport PYTHONDONTWRITEBYTECODE
# A process started with another environment's marker does not find its libraries, and a sourced
# ROS would shadow the one in .venv.
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
ifdef AMENT_PREFIX_PATH
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH
endif

.DEFAULT_GOAL := help
.PHONY: help setup demo check test docs bench paper bundle figures lint types-here types-on-windows
.PHONY: format lock clean

help:  ## show this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup:  ## set up .venv; PYTHON=3.10 or a path chooses its Python, VENV=folder another place
	@tools/setup.sh

# On this machine only, and apart from other graphs, unless the caller wants otherwise.
demo: export ROS_DOMAIN_ID ?= 87
demo: export ROS_AUTOMATIC_DISCOVERY_RANGE ?= LOCALHOST
demo: setup  ## plan the focus of a rig around a real body, through ROS
	@$(BIN)/focus_planner demo

check: lint  ## lint, and all tests that start no process; ARGS="-k name" goes to pytest
	@$(PYTEST) -m "not processes" $(ARGS)

test: lint  ## lint, and all tests; ARGS="-k name" goes to pytest
	@$(PYTEST) $(ARGS)

docs: setup  ## build the site in docs/_build/html; check its links and run its code
	@$(BIN)/sphinx-build -W -n -q --keep-going -b html docs docs/_build/html
	@$(PYTEST) test/docs
	@echo "docs/_build/html/index.html"

bench: setup  ## measure the planner; ARGS="speed quality" for a part, BODIES=folder, REV=revision
	@BODIES="$(BODIES)" REV="$(REV)" $(BIN)/python -m benchmarks $(ARGS)

# All that the page says is in its folder: with what is there, only what is missing is measured.
paper: setup  ## run the paper's experiments, and more, on data/bodies, for docs/results/paper.md
	@$(BIN)/focus_planner evaluate data/bodies --experiment all --output docs/results/paper \
	  --page docs/results/paper.md --about "$$(cat data/bodies/ABOUT.md)" $(ARGS)

bundle:  ## build what draws reports, from report_page/; takes Node 20 or later
	@cd report_page && npm ci --ignore-scripts --silent && npm run --silent build

figures: setup  ## draw every picture of README and docs anew; ARGS="gallery" for a part
	@$(BIN)/python -m figures $(ARGS)

lint: setup  ## style, types and import rules
	@$(BIN)/ruff check
	@$(BIN)/ruff format --check
	@$(MAKE) --no-print-directory --jobs 2 --output-sync=target types-here types-on-windows
	@$(BIN)/lint-imports

types-here:
	@$(BIN)/mypy

types-on-windows:
	@$(BIN)/mypy --platform win32 --cache-dir .mypy_cache/win32 --follow-imports silent \
	  --exclude '^focus_planner/(ros/|demo\.py|runtime/(fork_server|planning_process|stop_signals)\.py)'

format: setup  ## rewrite the code in the house style
	@$(BIN)/ruff check --fix-only --quiet
	@$(BIN)/ruff format

lock: setup  ## renew requirements.lock from requirements.in; ARGS="--upgrade" takes newer versions
	@$(BIN)/uv pip compile requirements.in --output-file requirements.lock --quiet $(ARGS) \
	  --universal --python-version 3.10 --generate-hashes --no-annotate --no-header \
	  --no-emit-index-url --no-emit-find-links
	@tools/check_lock.sh $(BIN)/uv

clean:  ## remove caches, and what builds leave; environments stay
	@rm -rf build dist install log *.egg-info .coverage .hypothesis
	@rm -rf docs/_build docs/api/modules docs/api/public_names.inc
	@rm -rf .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	@find . -path './.venv*' -prune -o -name __pycache__ -type d -exec rm -rf {} +
