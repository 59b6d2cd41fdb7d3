# Two commands: `make run` for the main job, `make test` for all checks.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

.PHONY: run test lint bench results capacity clean

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

lint: .venv/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: lint
	$(BIN)/pytest --numprocesses 2

# Speed, as ratios to the bare simulation; on an idle machine.
bench: .venv/installed-dev
	$(BIN)/pytest tests/benchmarks --benchmark-enable --benchmark-only -p no:xdist

# The committed evidence: all shipped scenarios of the paper, all controllers, twenty seeds; ten for
# the learned controllers below the rates that they are trained for.
RULES := traffic-light traffic-light-webster traffic-light-actuated max-pressure virtual-signal \
  first-come unsignalised
LOW := --rate 0.1 --rate 0.2 --rate 0.3
HIGH := --rate 0.4 --rate 0.5 --rate 0.6 --rate 0.7 --rate 0.8 --rate 0.9 --rate 1.0
STUDY := $(BIN)/rightofway run colorado-springs --out results
LEARNED := --controller wang --controller wang-tuned

results: .venv/installed
	rm -f results/records/*.jsonl
	$(STUDY) --seeds 20 $(LOW) $(HIGH) $(foreach name,$(RULES),--controller $(name))
	$(STUDY) --seeds 20 $(HIGH) $(LEARNED)
	$(STUDY) --seeds 10 $(LOW) $(LEARNED)

# The demand at which each rate jams, on intersection 334.
capacity: .venv/installed
	rm -f results/capacity/records/*.jsonl
	$(BIN)/rightofway run $(foreach total,700 1200 1700 2200 2700 3200 3700,334@$(total)) \
	  --seeds 10 --out results/capacity --controller unsignalised --controller wang \
	  --controller wang-tuned $(foreach rate,0.05 0.1 0.2 0.4,--rate $(rate))
	$(BIN)/rightofway capacity --records results/capacity > results/capacity/CAPACITY.md

clean:
	rm -rf .venv build dist out
