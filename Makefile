# `make demo` and `make test` need nothing but Python >= 3.11, make and git. `make help` lists all targets.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

TEST := $(BIN)/python -m pytest
SPEED ?= 1
SEEDS ?= 0:30

.PHONY: help install demo test test-all bench-sitl bench-planner bench-onboard bench-link bench-load experiment-modes experiment-missions soak fuzz bench-view screenshots check docs dist check-dist format check-px4 clean

help:  ## this list
	@grep -hE '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-12s %s\n", $$1, $$2}'

install: $(VENV)/.installed  ## make .venv with everything that flights need

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed, this is " + sys.version.split()[0]) if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: $(VENV)/bin/python pyproject.toml constraints.txt
	@echo "installing into $(VENV) (a minute or two)"
	$(PIP) -e .
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(PIP) -e '.[dev]'
	@touch $@

$(VENV)/.installed-bench: $(VENV)/.installed
	$(PIP) -e '.[bench]'
	@touch $@

demo: install  ## fly the paper's indoor mission on the bundled simulator and show it in the browser
	$(BIN)/gcs fly indoor --sim

test: $(VENV)/.installed-dev  ## all tests but the slow ones: first what runs in one process, then the real programs and the browser
	@$(BIN)/python -m tests.browser.chromium
	$(TEST) -n 2 -m "not slow and not processes and not browser"
	$(TEST) -m "not slow and (processes or browser)"

test-all: $(VENV)/.installed-dev  ## every test, the slow ones too
	@$(BIN)/python -m tests.browser.chromium
	$(TEST) --hypothesis-profile=new-examples -n 2 -m "not processes and not browser"
	$(TEST) -m "processes or browser"

bench-sitl: $(VENV)/.installed-dev  ## what the simulator costs: CPU, memory, pace, boot, with the required figures
	$(BIN)/python -m tests.benchmarks.sitl

bench-view: $(VENV)/.installed-dev  ## what the web page costs at 100 vehicles: CPU, traffic, reload, with the required figures
	$(BIN)/python -m tests.benchmarks.view $(BENCH)

screenshots: $(VENV)/.installed-dev  ## the pictures of the web page in docs/images
	$(BIN)/python -m tests.browser.screenshots

check-px4: install  ## fly the whole sequence on an autopilot that is there: make check-px4 LINK=udpin://0.0.0.0:14550
	@test -n "$(LINK)" || { echo "usage: make check-px4 LINK=udpin://0.0.0.0:14550 [SPEED=1]"; exit 2; }
	$(BIN)/gcs fly field --companions --sensor none --headless --origin here --link $(LINK) --speed $(SPEED) --report out/check-px4

bench-planner: $(VENV)/.installed-bench  ## the cloud planner beside its peers, about an hour: make bench-planner SEEDS=0:30 [BENCH=--quick]
	$(BIN)/python -m tests.benchmarks.planner --seeds $(SEEDS) $(BENCH)

experiment-modes: $(VENV)/.installed-dev  ## end and cloud together against either alone, flown in process: make experiment-modes SEEDS=0:10 [OUTPUT=docs/results]
	$(BIN)/python -m tests.experiments.modes --seeds $(SEEDS) $(if $(OUTPUT),--output $(OUTPUT))

experiment-missions: $(VENV)/.installed-dev  ## every shipped mission flown in full, in process: make experiment-missions SEEDS=0:1 [OUTPUT=docs/results]
	$(BIN)/python -m tests.experiments.missions --seeds $(SEEDS) $(if $(OUTPUT),--output $(OUTPUT))

bench-onboard: $(VENV)/.installed-dev  ## the onboard planner, alone (50 seeds are asked for) and in fleets: make bench-onboard SEEDS=0:10 [BENCH=--quick]
	@alone=0; $(BIN)/python -m tests.benchmarks.onboard --seeds $(SEEDS) $(BENCH) || alone=1; \
	$(BIN)/python -m tests.benchmarks.onboard.fleet_rows --seeds $(SEEDS) && exit $$alone

bench-link: $(VENV)/.installed-dev  ## missions over lossy links beside MAVSDK and MAVProxy, and a fleet of a hundred: make bench-link SEEDS=0:30 [BENCH=--quick]
	$(BIN)/python -m tests.benchmarks.link --seeds $(SEEDS) $(BENCH)

MINUTES ?= 10
bench-load: $(VENV)/.installed-dev  ## 100 vehicles for minutes: memory of simulator and ground station, what waits, what is lost: make bench-load MINUTES=10
	$(BIN)/python -m tests.benchmarks.load --minutes $(MINUTES) $(BENCH)

SEED0 ?= 0
soak: $(VENV)/.installed-dev  ## whole flights with everything going wrong, in process: make soak SEEDS=100 [SEED0=M]
	$(BIN)/python -m tests.soak --seeds $(if $(findstring :,$(SEEDS)),100,$(SEEDS)) --seed0 $(SEED0)

SECONDS ?= 60
fuzz: $(VENV)/.installed-dev  ## hostile traffic on all receive paths: make fuzz SECONDS=60
	$(BIN)/python -m tests.fuzz --seconds $(SECONDS)

$(VENV)/.installed-docs: $(VENV)/.installed
	$(PIP) -e '.[docs]'
	@touch $@

docs: $(VENV)/.installed-docs  ## the documentation as a site, in out/site; a broken link fails
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet -f .mkdocs.yml
	@echo "out/site/index.html"

dist: $(VENV)/.installed-dev  ## wheel and source archive, in dist
	$(BIN)/python -m build --outdir dist

check-dist: dist  ## the wheel in a virtual environment of its own, outside of this folder: it flies the indoor mission
	rm -rf out/wheel && $(PYTHON) -m venv out/wheel/venv
	out/wheel/venv/bin/pip install --quiet --disable-pip-version-check -c constraints.txt dist/*.whl
	cd out/wheel && venv/bin/gcs fly indoor --sim --headless --speed 5 --report flight

check: $(VENV)/.installed-dev  ## the fast checks: format, lint, types, import contracts
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	$(BIN)/pyright

format: $(VENV)/.installed-dev  ## put the code into the house's format
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

clean:  ## remove the environment and everything built
	rm -rf $(VENV) build dist out .pytest_cache .ruff_cache .hypothesis
