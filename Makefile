# Each target makes its own environment where it is missing: Python 3.11 or newer, make and git are enough.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
JOBS ?= 2

.PHONY: all smoke test lint docs bench cases clean
.DEFAULT_GOAL := all

all: $(VENV)/ready            ## the whole synthetic study of 12 subjects, ending with results/report.html
	$(BIN)/hrcneuro run pipelines/paper.toml -j $(JOBS)

smoke: $(VENV)/ready          ## three short subjects through every stage
	$(BIN)/hrcneuro run pipelines/smoke.toml -j $(JOBS) --workdir work/smoke

test: lint                    ## lint, types, import arrows, tests, and the smoke study twice
	$(BIN)/pytest -n $(JOBS)
	rm -rf work/smoke
	$(MAKE) --no-print-directory smoke
	$(BIN)/python tests/only_hits.py work/smoke

lint: $(VENV)/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(VENV)/ready           ## the documentation, every link checked, as build/docs/index.html
	$(BIN)/python -m sphinx -W --keep-going -q docs build/docs

bench: $(VENV)/ready          ## speed and memory against the tools that users would pick instead
	for bench in benchmarks/bench_*.py; do $(BIN)/python $$bench || exit 1; done

cases: $(VENV)/ready         ## small recordings that once broke the product, from FOLDER, as a table
	$(BIN)/python tests/product/eeg_cases.py $(or $(FOLDER),../shared/cases/eeg)

clean:
	rm -rf $(VENV) work cache results build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

$(VENV)/ready: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[test,lint]'
	touch $@
