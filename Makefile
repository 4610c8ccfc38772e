# SPDX-License-Identifier: BSD-3-Clause
# One target per thing one does with allanite. `make` alone lists them.
# Needs python3 (3.11 or newer) with venv and headers, make, and a C++ compiler; everything else is put in $(VENV).

PYTHON ?= python3
VENV   ?= .venv
JOBS   ?= 3
FUZZ_SECONDS ?= 600
FUZZ_SEED ?= $(shell date +%s)
MYPY_NUM_WORKERS ?= 2
# Some machines forbid compiled Python; hundreds of tests start the program, and each would compile it anew.
export PYTHONDONTWRITEBYTECODE :=

BIN := $(VENV)/bin
# Python sources are live in an editable install; only these call for a rebuild.
BUILD_INPUTS := pyproject.toml CMakeLists.txt $(wildcard kernels/*.in kernels/*.cpp kernels/*.hpp kernels/include/allanite/*.hpp)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo test test-long verify fuzz frozen faults coverage bench docs site links lint kernels-test firmware dist release-check workflows-check dev-build clean prerequisites

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-15s %s\n", $$1, $$2}' Makefile

demo: $(VENV)/.run ## the seed experiment on a simulated twin: a week at rest, four takes, thirteen figures, demo/report.html
	$(BIN)/allanite demo --seed-paper --out demo --force

test: $(VENV)/.dev ## run the tests, without the long ones (some minutes)
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal -q -m "not long"

test-long: $(VENV)/.dev ## the tests marked "long": many simulated records, killed runs, sanitizers (some minutes)
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal -q -m long

verify: $(VENV)/.dev ## long statistical runs (a day on two cores; what is done is kept); results go to verification/results
	$(BIN)/python -m verification

fuzz: $(VENV)/.dev ## damaged files of every format and damaged runs, FUZZ_SECONDS long; what fails is kept in build/fuzz
	$(BIN)/python -m tests.fuzz --seconds $(FUZZ_SECONDS) --seed $(FUZZ_SEED)

frozen: $(VENV)/.dev ## what the program says, against what was frozen before a refactoring (two minutes)
	OMP_NUM_THREADS=1 $(BIN)/python -m tests.frozen --check

faults: $(VENV)/.dev ## a hundred seeded faults of the source: does a test catch each? (ten minutes)
	OMP_NUM_THREADS=1 $(BIN)/python -m tests.faults

coverage: $(VENV)/.dev ## lines and branches that the tests run, in every process that they start (half an hour)
	$(BIN)/python -m pip install --quiet coverage
	mkdir -p build/coverage && rm -f build/coverage/data*
	@echo "tests of time and of what an import loads may fail: coverage is slow, and is loaded"
	-$(BIN)/python -m coverage run -m pytest -n $(JOBS) --dist worksteal -q
	$(BIN)/python -m coverage combine --quiet
	$(BIN)/python -m coverage report --skip-covered --show-missing >build/coverage/report.txt
	tail -n 1 build/coverage/report.txt

bench: $(VENV)/.dev ## speed and memory beside other tools and the last commit (rows that grew by 15 % are red)
	$(BIN)/python -m benchmarks

docs: $(VENV)/.docs ## bring the generated pages and figures up to date, run every example, build the site
	ALLANITE_WRITE_DOCS=1 $(BIN)/python -m pytest -q tests/test_docs.py tests/test_site.py
	$(MAKE) site

site: $(VENV)/.docs ## the documents as a site in build/site/index.html: searchable, without a network
	$(BIN)/python -m sphinx -q -W --keep-going -c docs/site -d build/site-cache . build/site

links: $(VENV)/.docs ## do the links of the documents to other sites still work? (needs a network)
	$(BIN)/python -m sphinx -q -b linkcheck -c docs/site -d build/site-cache . build/links

lint: $(VENV)/.dev ## style, security (the S rules of ruff), types and the import contract
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	MYPY_NUM_WORKERS=$(MYPY_NUM_WORKERS) $(BIN)/mypy --strict src verification packaging examples/seed_paper/allanite_seed_paper
	$(BIN)/lint-imports --no-cache

kernels-test: ## the C++ kernels alone, with sanitizers, without Python
	$(MAKE) -C kernels test

firmware: ## the filter example for a microcontroller: on this machine, and compiled for a Cortex-M4
	$(MAKE) -C firmware host cortex-m4 $(if $(MODEL),MODEL=$(abspath $(MODEL)))

dist: $(VENV)/.dev ## a wheel in dist/, its hashes and bill of materials checked
	rm -rf dist
	$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist .
	ALLANITE_WHEEL=$$(echo dist/*.whl) $(BIN)/python -m pytest -q tests/test_distribution.py
	cd dist && sha256sum *.whl >SHA256SUMS && cat SHA256SUMS

release-check: | prerequisites ## wheels for an old glibc, looked at, installed without a compiler and tried on every Python here
	$(PYTHON) packaging/release_check.py

workflows-check: | prerequisites ## do the workflows, forms and the citation follow their schemas?
	$(PYTHON) -m venv build/workflows
	build/workflows/bin/pip install --quiet check-jsonschema==0.39.0 zizmor==1.32.0 cibuildwheel==4.3.5
	build/workflows/bin/zizmor --offline --no-progress --min-severity medium .github
	build/workflows/bin/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	build/workflows/bin/check-jsonschema --builtin-schema vendor.dependabot .github/dependabot.yml
	build/workflows/bin/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	for system in linux macos windows pyodide; do \
		build/workflows/bin/cibuildwheel --platform $$system --print-build-identifiers . || exit 1; done

dev-build: ## rebuild the compiled module for the Python on PATH (in an active environment)
	python -m pip install --quiet --no-build-isolation --no-deps -Cbuild-dir=build/{wheel_tag} \
		-Ccmake.define.ALLANITE_WERROR=ON -e .

clean: ## remove everything that was built, the local environment included
	rm -rf build dist demo docs/reference/python $(VENV) .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# ---- the local environment ------------------------------------------------------------------------------------------
# --no-compile: Python compiles what it imports, which is a third of what is installed.

$(BIN)/python: | prerequisites
	$(PYTHON) -m venv $(VENV)

$(VENV)/.run: $(BUILD_INPUTS) | $(BIN)/python
	$(BIN)/python -m pip install --quiet --no-compile -e ".[plot]"
	@touch $@

# uv installs a hundred packages in half of pip's time; pip is asked where uv cannot reach them, as behind an index of its own.
$(VENV)/.dev: $(BUILD_INPUTS) | $(BIN)/python
	{ $(BIN)/python -m pip install --quiet --no-compile uv \
		&& $(BIN)/uv pip install --quiet --python $(BIN)/python -e ".[dev]"; } \
		|| $(BIN)/python -m pip install --quiet --no-compile -e ".[dev]"
	@touch $(VENV)/.run $@

$(VENV)/.docs: $(VENV)/.dev
	$(BIN)/uv pip install --quiet --python $(BIN)/python -r pyproject.toml --extra docs \
		|| $(BIN)/python -m pip install --quiet --no-compile -e ".[docs]"
	@touch $@

# Says what is missing, and the command that brings it, before anything starts.
prerequisites:
	@command -v $(PYTHON) >/dev/null \
		|| { echo "make: $(PYTHON) is missing: sudo apt-get install python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "make: $(PYTHON) is older than 3.11: sudo apt-get install python3, or make PYTHON=python3.12 ..." >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
		|| { echo "make: Python's venv is missing: sudo apt-get install python3-venv" >&2; exit 1; }
	@$(PYTHON) -c 'import os, sys, sysconfig; sys.exit(not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")))' \
		|| { echo "make: Python's headers are missing: sudo apt-get install python3-dev" >&2; exit 1; }
	@command -v $(CXX) >/dev/null \
		|| { echo "make: the C++ compiler '$(CXX)' is missing: sudo apt-get install g++" >&2; exit 1; }
