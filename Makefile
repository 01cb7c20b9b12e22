# `make help` lists what there is. Nothing here needs more than Python 3.11+ and make; everything that is
# installed goes into $(VENV).

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
WORKERS ?= 2
ARGS ?=

# One process per core in tests: the libraries below would otherwise start threads in each of them.
export OMP_NUM_THREADS ?= 1
export NUMBA_NUM_THREADS ?= 1

.DEFAULT_GOAL := help
.PHONY: help setup demo lint format type layers test test-all examples case-study conformity corpus images bench coexist freecad ci clean

help: ## list the targets
	@grep -E '^[a-z-]+:.*## ' $(firstword $(MAKEFILE_LIST)) | sed -E 's/^([a-z-]+):.*## /\1|/' \
	    | while IFS='|' read -r name what; do printf '  %-10s %s\n' "$$name" "$$what"; done

setup: $(VENV)/.dev ## make the environment with all extras and the tools of development

demo: $(VENV)/.demo ## fresh machine: install, turn an example part into an as-made mesh and a picture in demo/
	@$(BIN)/cadskin doctor --no-imports --repair > $(VENV)/doctor.txt || { cat $(VENV)/doctor.txt; exit 1; }
	@mkdir -p demo
	$(BIN)/cadskin convert examples/parts/bracket.step -o demo/bracket_skin.stl --tolerance 0.1 --seed 7

lint: $(VENV)/.dev ## ruff: rules and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

format: $(VENV)/.dev ## ruff: repair what can be repaired
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

type: $(VENV)/.dev ## mypy, strict
	$(BIN)/mypy

layers: $(VENV)/.dev ## import-linter: data flows one way, the kernel lives in cad only
	$(BIN)/lint-imports

test: $(VENV)/.dev ## the tests of every day (ARGS="-k word" narrows them)
	$(BIN)/pytest -n $(WORKERS) -m "not slow" $(ARGS)

test-all: $(VENV)/.dev ## all tests, the slow ones too
	$(BIN)/pytest -n $(WORKERS) $(ARGS)

examples: $(VENV)/.dev ## run every example and check the number it returns
	$(BIN)/pytest tests/test_examples.py $(ARGS)

case-study: $(VENV)/.dev ## the paper's case study: docs/case_study.md and its pictures (no solver needed)
	PYTHONPATH=examples $(BIN)/python -m case_study

conformity: $(VENV)/.dev ## simulate the AP242 files of $$CADSKIN_CORPUS inside their tolerances; docs/conformity.md
	$(BIN)/python benchmarks/conformity_table.py $(ARGS)

corpus: $(VENV)/.dev ## mesh the STEP files in $$CADSKIN_CORPUS; the table goes to docs/corpus.md
	$(BIN)/python benchmarks/corpus_table.py $(ARGS)

images: $(VENV)/.dev ## draw the pictures of the README and of docs/deviations.md again
	@mkdir -p docs/images
	$(BIN)/python examples/03_step_to_skin.py docs/images/bracket_skin.png
	$(BIN)/python examples/20_systematic_forms.py docs/images/deviations_forms.png
	$(BIN)/python examples/21_random_fields.py docs/images/deviations_random.png
	$(BIN)/python examples/22_processes_and_data.py docs/images/deviations_processes.png
	$(BIN)/python examples/24_all_models.py docs/images/deviations_all.png

bench: $(VENV)/.dev ## run the benchmarks (each prints its own table)
	@for script in benchmarks/bench_*.py; do echo "== $$script"; $(BIN)/python $$script || exit 1; done

coexist: $(VENV)/.base ## cadquery and build123d in one fresh environment, broken and repaired on purpose
	$(BIN)/python tests/coexist.py

# A machine without FreeCAD says so and goes on; CADSKIN_NEED_FREECAD=1 makes that an error (.ci/run on Debian).
freecad: $(VENV)/.dev ## the workbench in a real FreeCAD, without and with a window (pictures in artifacts/freecad)
	@if command -v freecadcmd > /dev/null; then \
	    $(BIN)/python tests/freecad/run_headless.py && \
	    $(BIN)/python tests/freecad/run_gui_tests.py --out artifacts/freecad; \
	elif [ -n "$$CADSKIN_NEED_FREECAD" ]; then echo "freecad: there is no freecadcmd" >&2; exit 1; \
	else echo "freecad: skipped, there is no freecadcmd on this machine"; fi

ci: lint type layers test coexist freecad ## what .ci/run calls

clean: ## remove what the other targets made
	rm -rf $(VENV) demo artifacts build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find cadskin tests examples benchmarks -name __pycache__ -prune -exec rm -rf {} +

# --- environments -----------------------------------------------------------------------------------------

# --group needs pip 25.1.
$(VENV)/.base:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	    || { echo "cadskin needs Python 3.11 or newer; name one: make PYTHON=python3.12 ..."; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1'
	@touch $@

$(VENV)/.demo: $(VENV)/.base pyproject.toml
	$(BIN)/python -m pip install --quiet --editable .
	@touch $@

# Both OCP wheels are installed here and write the same files; when the wrong one came last, put it right.
$(VENV)/.dev: $(VENV)/.base pyproject.toml
	$(BIN)/python -m pip install --quiet --editable '.[all]' --group dev
	$(BIN)/cadskin doctor --no-imports --repair
	@touch $@ $(VENV)/.demo
