# Every target does all of its own set-up: it makes .venv and installs into it what constraints.txt pins, and does so
# again when pyproject.toml or constraints.txt changes.  `make PYTHON=/path/to/python3.12 test` chooses the interpreter.

.DEFAULT_GOAL := help
.NOTPARALLEL:
PY := .venv/bin/python
SCENE ?= paper-designed

# A worker of the tests for each core, each of up to 2 GB, or 5 GB where all has to be compiled; one that is done takes
# tests from the others.
WORKERS ?= logical
PYTEST := $(PY) -m pytest -n $(WORKERS) --maxprocesses 8 --dist worksteal

# For pip inside `python -m build` too, where the build backend is installed; newer pip reads the second name there.
export PIP_CONSTRAINT := constraints.txt
export PIP_BUILD_CONSTRAINT := constraints.txt
export PIP_DISABLE_PIP_VERSION_CHECK := 1
unexport PYTHONPATH PYTHONHOME

# A checkout that was copied or moved with its .venv would go on importing the package from the old place.
$(shell test "$$(cat .venv/checkout 2>/dev/null)" = "$(CURDIR)" || rm -f .venv/*.stamp)

help:  ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' Makefile

analyse: .venv/run.stamp  ## report and pictures of the paper's designed feeder (SCENE=... for another)
	$(PY) -m limitsets analyse $(SCENE)

test: .venv/dev.stamp  ## the tests, with the examples in the docstrings, the studies and the notebooks
	$(PYTEST) -m "not sweep and not repeats"

test-all: .venv/dev.stamp  ## these and the long ones: many random examples, searches
	$(PYTEST) -m "not repeats"

repeats: .venv/dev.stamp  ## more random examples of what test-all checks with fewer; no part of CI
	$(PYTEST) -m repeats

lint: .venv/dev.stamp  ## ruff: rules and format
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .

types: .venv/dev.stamp  ## mypy
	$(PY) -m mypy

contracts: .venv/dev.stamp  ## which wing may import which, and the sizes on record
	.venv/bin/lint-imports
	$(PY) -m tests.sizes

bench: .venv/bench.stamp  ## the benchmarks, with their rivals in the same run
	$(PY) -m pytest tests/bench -s --benchmark-quiet

docs: .venv/dev.stamp  ## the site, into build/site: pages, notebooks, and the reference from the docstrings
	rm -rf docs/api
	$(PY) -m sphinx -W --keep-going -q -c docs . build/site
	@echo "open build/site/docs/index.html"

linkcheck: .venv/dev.stamp  ## whether links of the pages to other sites are alive (needs the internet)
	$(PY) -m sphinx -q -b linkcheck -c docs . build/linkcheck

checker: $(PY)  ## the recheck of certificates in one file to copy away, dist/recheck.pyz
	$(PY) limitsets/checker/build.py dist/recheck.pyz

studies: .venv/dev.stamp  ## run every study again, writing its figures and numbers
	set -e; for study in studies/*/study.py studies/*/effects.py; do $(PY) $$study; done

notebooks: .venv/dev.stamp  ## run every notebook again, in place
	set -e; for notebook in notebooks/*.ipynb; do .venv/bin/jupyter-execute --inplace $$notebook; done
	$(PY) notebooks/palette.py notebooks/*.ipynb

check: lint types contracts test-all docs  ## all that has to pass

clean:  ## remove .venv, caches and what was built
	rm -rf .venv build dist docs/api .benchmarks .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

.venv/run.stamp: extras := [atlas,drawing,engine,explore]
.venv/dev.stamp: extras := [dev]
.venv/bench.stamp: extras := [dev,bench]
.venv/run.stamp .venv/dev.stamp .venv/bench.stamp: pyproject.toml constraints.txt $(PY)
	@echo "setting up .venv: a minute or two, once"
	$(PY) -m pip install --quiet --editable '.$(extras)'
	@echo "$(CURDIR)" > .venv/checkout
	@touch $@

# A name on the PATH may be a shim that does not run, or a Python without ensurepip: take the first that can do it.
$(PY):
	@for python in $(PYTHON) python3.13 python3.12 python3.11 python3; do \
	    if $$python -c 'import ensurepip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	        exec $$python -m venv --clear .venv; \
	    fi; \
	done; \
	echo "no Python 3.11 or newer with venv found: install one (on Debian and Ubuntu also python3-venv)," >&2; \
	echo "or name it: make PYTHON=/path/to/python3.12" >&2; \
	exit 1

gallery: .venv/dev.stamp  ## draw the pictures of docs/gallery.md again
	cd docs/gallery && awk '/^```python/ { on = 1; next } /^```/ { on = 0 } on' ../gallery.md | ../../$(PY) -

.PHONY: help analyse test test-all repeats lint types contracts bench docs linkcheck checker studies notebooks gallery check clean
