# Each target makes its own environment where it is missing: Python 3.11 or newer, make and git are enough.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
PIP := $(BIN)/pip install --quiet --constraint constraints.txt --editable

.PHONY: all smoke test chaos lint docs bench cases live installs clean
.DEFAULT_GOAL := all

all:                          ## the whole synthetic study of 12 subjects, ending with results/report.html
	@echo "The whole study on $(JOBS) workers: about 20 minutes on two cores, and 8 GB of disk in this folder (cache/)."
	@echo "Ctrl-C ends it at any time; the same command goes on from there. 'make smoke' is the same in short."
	@$(MAKE) --no-print-directory $(VENV)/runs
	$(BIN)/hrcneuro run pipelines/paper.toml -j $(JOBS)

smoke: $(VENV)/runs           ## three short subjects through every stage
	$(BIN)/hrcneuro run pipelines/smoke.toml -j $(JOBS) --workdir work/smoke

test: lint                    ## lint, types, import arrows, tests, and the smoke study twice
	rm -rf work/smoke
	SMOKE=work/smoke $(BIN)/pytest -n $(JOBS) --dist worksteal
	$(BIN)/python tests/only_hits.py work/smoke

chaos: $(VENV)/ready          ## faults of many kinds, and a table: tried, survived, lost; KILLS, TRIALS and SEED change it
	$(BIN)/python tests/chaos

lint: $(VENV)/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(VENV)/documents       ## the documentation, every link checked, as build/docs/index.html
	$(BIN)/python docs/generated.py
	$(BIN)/python -m sphinx -W --keep-going -q docs build/docs

bench: $(VENV)/ready          ## speed and memory against the tools that users would pick instead
	@$(BIN)/python benchmarks/_measure.py
	for bench in benchmarks/bench_*.py; do $(BIN)/python $$bench || exit 1; done

cases: $(VENV)/ready          ## what once broke the product, from FOLDER/eeg and FOLDER/robot, as tables; half an hour
	$(BIN)/python tests/product/eeg_cases.py $(or $(FOLDER),../shared/cases)/eeg; eeg=$$?; \
	$(BIN)/python tests/product/robot_cases.py $(or $(FOLDER),../shared/cases)/robot && exit $$eeg

live: $(VENV)/ready           ## in real time: the window, a block of the experiment, a closed loop, half an hour of recording, thirty kills; 105 minutes
	$(BIN)/python tests/product/live_window.py; window=$$?; \
	$(BIN)/python tests/product/live_experiment.py; experiment=$$?; \
	$(BIN)/python tests/product/live_loop.py; loop=$$?; \
	$(BIN)/python tests/product/live_runs.py && exit $$((window | experiment | loop))

installs:                     ## the product as people install it, from a wheel: pip, pipx, uv, and the oldest libraries allowed
	$(PYTHON) tests/product/installs.py

clean:
	rm -rf $(VENV) work cache results build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

# What running needs; then what the documentation, and what the tests need besides.
$(VENV)/runs: pyproject.toml constraints.txt
	@echo "First the environment, $(VENV): a minute or two, and a download of the libraries."
	$(PYTHON) -m venv $(VENV)
	$(PIP) .
	@# As pip does with a package that is no working copy: else, where nothing may write them later, every start compiles.
	$(BIN)/python -m compileall -q hrcneuro
	touch $@

$(VENV)/documents: $(VENV)/runs
	$(PIP) '.[docs]'
	touch $@

$(VENV)/ready: $(VENV)/runs
	$(PIP) '.[test,lint]'
	touch $@
