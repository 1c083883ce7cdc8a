# Everything that is done with a checkout. `make` alone lists the targets.
# Kept to what GNU make 3.81 knows.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RESULTS ?= results
JOBS ?=
RUN := $(BIN)/rigidpend
# Bytes of what is imported are compiled then: to compile all takes as long as to install.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt
PYTEST := $(BIN)/python -m pytest -n $(or $(JOBS),auto) --dist loadfile

# Where Python is told to keep no compiled code each of some hundred processes compiles all anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup figures check test test-fast test-wheel test-lowest attacks coverage audit docs mutants verify reference bench stress tables gallery clean distclean

help: ## list the targets
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 12

setup: $(VENV)/.installed ## make .venv and install the package into it; other targets do so by themselves

figures: $(VENV)/.installed ## set up, run every config, draw every figure and a report into results/
	$(RUN) run all --out "$(RESULTS)" $(if $(JOBS),-j $(JOBS))
	$(RUN) render all --out "$(RESULTS)"
	$(RUN) report --out "$(RESULTS)"

check: $(VENV)/.installed-test ## check format, lint, which way imports go, and types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports --no-logo --no-cache
	$(BIN)/mypy

test: check ## check, then run every test, on all cores
	$(PYTEST)

test-fast: $(VENV)/.installed-test ## run the tests that are not marked slow: the inner loop
	$(PYTEST) -m "not slow"

# What a stranger has: no checkout around him, only what is installed.
USED = cd build/$@ && bin/rigidpend run fig1 fig4 closed_orbits -q \
  && bin/rigidpend render fig1 fig4 closed_orbits && bin/rigidpend verify fig1 fig4

test-wheel: $(VENV)/.installed-test ## build the wheel, install it by itself and use it: versions of constraints.txt
	rm -rf build/$@
	$(PYTHON) -m venv build/$@
	build/$@/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps -w build/$@/dist .
	build/$@/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt build/$@/dist/*.whl
	$(USED)
	cd build/$@ && ../../$(BIN)/mypy --config-file= --strict --python-executable bin/python -c 'import rigidpend'

test-lowest: ## use the package with the lowest versions that pyproject.toml allows
	rm -rf build/$@
	$(PYTHON) -m venv build/$@
	$(PYTHON) -m scripts.lowest > build/$@/lowest.txt
	build/$@/bin/python -m pip install --quiet --disable-pip-version-check -c build/$@/lowest.txt .
	$(USED)

attacks: $(VENV)/.installed-test ## random attacks of every kind, repeatable by their seed: half an hour; COUNT= SEED=
	RIGIDPEND_ATTACKS=$(or $(COUNT),2000) RIGIDPEND_SEED=$(or $(SEED),1) $(PYTEST) tests/attacks tests/test_api_values.py tests/runs/test_forgeries.py tests/runs/test_certificates.py tests/runs/test_faults.py tests/runs/test_cluster.py tests/machine/test_signals.py tests/routes/certified/test_energies.py tests/routes/certified/test_intervals.py tests/routes/certified/test_passages.py

coverage: $(VENV)/.installed-test ## run every test and say which lines and branches they leave out
	$(PYTEST) --cov --cov-report=term:skip-covered --cov-report=html:build/coverage

audit: ## look up known vulnerabilities of the versions in constraints.txt, where that can be asked
	@test -x build/audit/bin/pip-audit || { $(PYTHON) -m venv build/audit \
	  && build/audit/bin/python -m pip install --quiet --disable-pip-version-check pip-audit; } \
	  || echo "pip-audit cannot be installed here" >&2
	@$(or $(wildcard build/audit/bin/python),$(PYTHON)) scripts/audit.py

docs: $(VENV)/.installed-docs build/mathjax/tex-svg.js ## build the documentation into build/docs/, which fetches nothing when read
	rm -rf build/docs
	$(BIN)/python -m sphinx -b html -d build/doctrees -W --keep-going -q docs build/docs
	@grep -q 'row 0 = symbol 1' build/docs/python.html || { echo "named tuples are without their fields" >&2; exit 1; }
	@! grep -rlE '<(script|link|img)[^>]*(src|href)="(https?:)?//' --include='*.html' build/docs \
	  || { echo "the pages above would fetch something from elsewhere" >&2; exit 1; }
	$(BIN)/python -m scripts.look build/docs

# Sets the formulas, in the reader's browser and from beside the pages.
MATHJAX := 3.2.2
build/mathjax/tex-svg.js:
	@command -v npm >/dev/null || { echo "the formulas need npm: install Node.js (Debian: npm)" >&2; exit 1; }
	mkdir -p build/npm build/mathjax
	npm install --silent --no-save --prefix build/npm mathjax@$(MATHJAX)
	cp build/npm/node_modules/mathjax/es5/tex-svg.js $@

mutants: $(VENV)/.installed-test ## change the code in places drawn by lot: do tests fail? some hours; COUNT= SEED=; goes on where it was
	$(BIN)/python -m scripts.mutants $(if $(COUNT),--count $(COUNT)) $(if $(SEED),--seed $(SEED)) $(if $(JOBS),--processes $(JOBS))

verify: $(VENV)/.installed ## compute every experiment again and compare with results/reference/
	$(RUN) verify all $(if $(JOBS),-j $(JOBS))

reference: $(VENV)/.installed ## renew results/reference/: make reference REASON="why" [NAMES="fig4 fig5"]
	$(RUN) reference $(or $(NAMES),all) --reason "$$REASON" $(if $(JOBS),-j $(JOBS))

bench: $(VENV)/.installed-bench ## measure against other methods, store, renew README and docs/measured.md; some five minutes, alone
	$(RUN) bench --out "$(RESULTS)"
	mkdir -p results/measured results/gallery
	cp "$(RESULTS)"/bench.h5 results/measured/
	cp "$(RESULTS)"/bench.png results/gallery/
	$(BIN)/python -m scripts.readme_tables

stress: $(VENV)/.installed ## trials at the limits, store, renew docs/measured.md; some ten minutes on two cores
	$(RUN) stress --out "$(RESULTS)"
	mkdir -p results/measured results/gallery
	cp "$(RESULTS)"/stress.h5 results/measured/
	cp "$(RESULTS)"/stress.png results/gallery/
	$(BIN)/python -m scripts.readme_tables

tables: $(VENV)/.installed ## write the tables of README and docs/measured.md from results/measured/
	$(BIN)/python -m scripts.readme_tables

gallery: $(VENV)/.installed ## draw the figures of results/reference/ into results/gallery/, for the README
	$(RUN) render all --out results/reference
	mv results/reference/*.png results/gallery/

clean: ## remove results and caches, keep the set-up
	rm -rf "$(RESULTS)"/*.h5 "$(RESULTS)"/*.log "$(RESULTS)"/*.png "$(RESULTS)"/*.svg "$(RESULTS)"/*.pdf
	rm -rf "$(RESULTS)"/.*.parts "$(RESULTS)"/report.html
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage .coverage.*
	rm -rf build/coverage build/docs build/doctrees docs/generated
	find rigidpend tests scripts docs -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## remove the set-up too
	rm -rf $(VENV)

# Stamps are touched last, so that a broken set-up is made again.

$(VENV)/.created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	  || { echo "rigidpend needs Python 3.11 or newer, and '$(PYTHON)' is older or absent: call make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
	  || { echo "'$(PYTHON)' lacks the module venv: install your system's package for it (Debian: python3-venv) and call make again" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.installed: $(VENV)/.created pyproject.toml constraints.txt
	$(PIP) -e .
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(PIP) -e '.[test]'
	@touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	$(PIP) -e '.[docs]'
	@touch $@

$(VENV)/.installed-bench: $(VENV)/.installed
	$(PIP) -e '.[bench]'
	@touch $@
