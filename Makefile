# Two commands: `make run` for the main job, `make test` for all checks.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

.PHONY: run test slow-tests results-check lint browser bench scaling large-store saturation soak replay-speed results figures site screenshots architecture reference ablations capacity clean

run: .venv/installed
	$(BIN)/rightofway run colorado-springs --rate 0.4 --rate 0.5 --rate 0.6 --rate 0.7 --seeds 2 --out out

.venv/bin/python:
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml constraints.txt | .venv/bin/python
	$(PIP) --editable .
	touch $@

.venv/installed-dev: pyproject.toml constraints.txt | .venv/bin/python
	$(PIP) --editable '.[dev]'
	touch $@ .venv/installed

# Debian's Chromium, in which the tests open the pages.
browser:
	@tests/install-chromium.sh

lint: .venv/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: lint browser
	RIGHTOFWAY_TESTS_NEED_CHROMIUM=1 $(BIN)/pytest --numprocesses 2

# What is slow by nature: whole trainings, sweeps over all that misbehaves, packages built and installed.
slow-tests: .venv/installed-dev browser
	RIGHTOFWAY_TESTS_NEED_CHROMIUM=1 $(BIN)/pytest --numprocesses 2 -m slow

# What is committed in results/ follows from its records, says what the docs say, and comes out again.
results-check: .venv/installed-dev
	$(BIN)/pytest tests/results/check_*.py --numprocesses 2

# Speed, as ratios to the bare simulation; on an idle machine.
bench: .venv/installed-dev
	$(BIN)/pytest tests/benchmarks --benchmark-enable --benchmark-only -p no:xdist

# What large suites need; docs/scaling.md keeps what it says of an idle machine.
scaling: .venv/installed-dev
	$(BIN)/python tests/benchmarks/scaling.py

# A folder of a million records; takes 4 GB of disk.
large-store: .venv/installed-dev
	$(BIN)/python tests/benchmarks/large_store.py

# Discharge in SUMO over the formula of saturation flow; docs/methods.md keeps it.
saturation: .venv/installed-dev
	PYTHONPATH=tests $(BIN)/python tests/benchmarks/saturation.py

# Suites under random faults, here and on a cluster; docs/suites.md keeps what it said.
soak: .venv/installed-dev
	$(BIN)/python tests/benchmarks/soak.py
	$(BIN)/python tests/benchmarks/soak.py --cluster

# The committed evidence: all shipped scenarios of the paper, all controllers, twenty seeds.
results: .venv/installed
	rm -f results/records/*.jsonl
	$(BIN)/rightofway run colorado-springs --seeds 20 --out results \
	  $(foreach rate,0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 1.0,--rate $(rate))

# The results as figures, with their captions: results/figures.
figures: .venv/installed
	$(BIN)/rightofway figures --records results --training results/training --controller wang \
		--controller wang-tuned --controller hierarchical --controller hierarchical-tuned \
		--controller time-windows

# The results as pages, with a replay of each intersection, and pictures of them for the README.
site: .venv/installed
	for name in 229 332 334 449; do \
	  $(BIN)/rightofway replay $$name --controller wang --controller hierarchical-tuned \
	    --rate 0.6 --seed 3 -o results/replays/$$name.html || exit 1; \
	done
	$(BIN)/rightofway site --records results --output site

# What replays cost, and how smoothly they play; on an idle machine.
replay-speed: .venv/installed-dev browser
	$(BIN)/python tests/benchmarks/replay_speed.py

screenshots: .venv/installed-dev browser site
	$(BIN)/python tests/screenshots.py site docs

# The rooms and who imports whom, for docs/architecture.md.
architecture: .venv/installed-dev
	$(BIN)/python tests/architecture.py

# What the regression check compares with; commit first, as it names the commit.
reference: .venv/installed
	$(BIN)/rightofway reference update

# What each part of time windows is worth; docs/time-windows.md says what the variants are.
VARIANTS := growth=0&after=1.4&before=2.0 later_slots=0 stretches=movements spread=false
ablations: .venv/installed
	rm -f results/time-windows/records/*.jsonl
	$(BIN)/rightofway run colorado-springs --seeds 20 --out results/time-windows \
	  --rate 0.4 --rate 0.6 --controller traffic-light --controller time-windows \
	  $(foreach options,$(VARIANTS),--controller 'time-windows?$(options)')

# The demand at which each rate jams, on intersection 334.
capacity: .venv/installed
	rm -f results/capacity/records/*.jsonl
	$(BIN)/rightofway run $(foreach total,700 1400 2100 2800 3500,334@$(total)) \
	  --seeds 5 --out results/capacity --controller unsignalised --controller wang \
	  $(foreach rate,0.05 0.1 0.2 0.4,--rate $(rate))
	$(BIN)/rightofway capacity --records results/capacity > results/capacity/CAPACITY.md

clean:
	rm -rf .venv build dist out site
