# El Dorado. `make help` lists the targets. Everything stays inside this folder: .venv and build.
.DEFAULT_GOAL := help
PYTHON ?= $(shell command -v python3.11 || command -v python3)
SEED ?= 1
TERRAIN ?= fbm
B := .venv/bin
NATIVE := CMakeLists.txt pyproject.toml $(wildcard onboard/native/*.?pp hil/native/*.?pp)
FIXED := PYTHONHASHSEED=0 OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1

.venv/.packages: requirements.lock tools/check_system.sh
	@sh tools/check_system.sh "$(PYTHON)"
	@echo "setting up .venv (once; a minute or two)"
	@$(PYTHON) -m venv --clear .venv
	@$(B)/python -m pip install --quiet --disable-pip-version-check --only-binary :all: --require-hashes -r requirements.lock
	@touch $@

.venv/.project: .venv/.packages $(NATIVE)
	@echo "building and installing the project"
	@$(B)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --editable .
	@touch $@

demo: .venv/.project ## drive a rover across rocks to its goal on the bench; SEED=n, TERRAIN=real
	@$(B)/hil demo --seed $(SEED) --terrain $(TERRAIN)

sim: .venv/.project ## bench, rover and link in real time until Ctrl-C; try `ground` from another terminal
	@$(B)/hil sim --seed $(SEED) --terrain $(TERRAIN)

test: .venv/.project ## the fast test suite (under 5 minutes on two cores)
	@$(FIXED) $(B)/python -m pytest -n 2 --dist loadgroup

lint: .venv/.project ## ruff, mypy --strict on protocol and onboard, import contracts
	@$(B)/ruff check .
	@$(B)/mypy
	@$(B)/lint-imports --no-cache

bench: .venv/.project ## measure; QUICK=1 for two repeats; writes build/bench.json
	@$(FIXED) $(B)/python -m tests.bench $(if $(QUICK),--quick)

nightly: lint test bench ## everything that tests or measures, with ten demo seeds and real ground
	@for seed in 1 2 3 4 5 6 7 8 9 10; do $(B)/hil demo --seed $$seed --out build/nightly/seed-$$seed || echo "seed $$seed failed" >> build/nightly/failed; done
	@$(B)/hil demo --terrain real --out build/nightly/real
	@$(B)/hil tally build/nightly

codec: .venv/.project ## make the generated files in protocol/ anew from rover.dbc and eldorado.xml
	@$(B)/python -m tools.make_can_codec
	@$(B)/python -m tools.make_dialect

docs: .venv/.project ## make the pages docs/faults, modes, commands and the pictures of docs/as-printed anew
	@$(B)/python -m tools.make_docs
	@$(B)/python -m tools.make_pictures

size: ## lines of each package
	@git ls-files '*.py' '*.hpp' '*.cpp' | grep -v -e can_codec.py -e eldorado_dialect.py | xargs wc -l | sort -n | tail -40

clean: ## remove build and .venv
	@rm -rf build .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis

help: ## this list
	@grep -E '^[a-z-]+:.*##' Makefile | sed 's/:.*## /\t/' | expand -t 12

.PHONY: demo sim test lint bench nightly codec docs size clean help
