# Everything that is done with a checkout. `make` alone lists the targets.
# Kept to what GNU make 3.81 knows.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RESULTS ?= results
JOBS ?=
RUN := $(BIN)/rigidpend

.PHONY: help figures test mutants verify reference bench stress gallery clean distclean

help: ## list the targets
	@grep -E '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 12

figures: $(VENV)/.installed ## set up, run every config, draw every figure and a report into results/
	$(RUN) run all --out $(RESULTS) $(if $(JOBS),-j $(JOBS))
	$(RUN) render all --out $(RESULTS)
	$(RUN) report --out $(RESULTS)

test: $(VENV)/.installed-test ## set up, check format, lint and types, run the tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python -m pytest

mutants: $(VENV)/.installed-test ## change the code in places drawn by lot: do tests fail? half an hour; COUNT= SEED=
	$(BIN)/python scripts/mutants.py $(if $(COUNT),--count $(COUNT)) $(if $(SEED),--seed $(SEED)) $(if $(JOBS),--processes $(JOBS))

verify: $(VENV)/.installed ## compute every experiment again and compare with results/reference/
	$(RUN) verify all $(if $(JOBS),-j $(JOBS))

reference: $(VENV)/.installed ## renew results/reference/: make reference REASON="why" [NAMES="fig4 fig5"]
	$(RUN) reference $(or $(NAMES),all) --reason "$$REASON" $(if $(JOBS),-j $(JOBS))

bench: $(VENV)/.installed ## run time against error, on this machine; some twenty minutes
	$(RUN) bench --out $(RESULTS)

stress: $(VENV)/.installed ## trials at the limits; some ten minutes on two cores
	$(RUN) stress --out $(RESULTS)

gallery: figures ## draw every figure and keep it in results/gallery/, for the README
	mkdir -p results/gallery
	cp $(RESULTS)/*.png results/gallery/

clean: ## remove results and caches, keep the set-up
	rm -rf $(RESULTS)/*.h5 $(RESULTS)/*.log $(RESULTS)/*.png $(RESULTS)/*.svg $(RESULTS)/*.pdf
	rm -rf $(RESULTS)/.*.parts $(RESULTS)/report.html
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find rigidpend tests scripts -name __pycache__ -type d -prune -exec rm -rf {} +

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
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test]'
	@touch $@
