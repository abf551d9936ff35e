# El Dorado. `make help` lists the targets. Everything stays inside this folder: .venv and build.
.DEFAULT_GOAL := help
PYTHON ?= $(shell sh tools/find_python.sh)
SEED ?= 1
FUZZ_S ?= 120
TERRAIN ?= fbm
LAWS ?= fast
MINUTES ?= 3
PREFIX ?= /usr/local
SYSCONFDIR ?= /etc
B := .venv/bin
ROVER ?= .rover
FLIES ?= .venv
NATIVE := CMakeLists.txt pyproject.toml $(wildcard onboard/kernels/*.?pp hil/native/*.?pp)
KERNEL_TESTS := tests/onboard/kernel_calls/test_kernels.py tests/onboard/kernel_calls/test_live_grid.py tests/onboard/planning/local/test_pose_field.py \
	tests/onboard/perception/map/test_ldem.py tests/onboard/perception/map/test_cell_classes.py tests/onboard/kernel_calls/test_class_kernels.py \
	tests/onboard/planning/sensing/test_visibility.py tests/onboard/kernel_calls/test_visibility_kernels.py tests/onboard/kernel_calls/test_kernel_fuzz.py \
	tests/onboard/planning/sensing/test_next_position.py tests/onboard/planning/local/test_distance_transform.py tests/onboard/planning/test_global_path.py \
	tests/onboard/kernel_calls/test_global_field.py tests/onboard/kernel_calls/test_search_kernels.py tests/onboard/planning/local/test_path.py \
	tests/onboard/kernel_calls/test_scip_kernel.py tests/onboard/native/test_elementary.py \
	tests/onboard/native/test_linear.py tests/hil/plant/test_soil.py
SANITIZED := EL_DORADO_KERNELS=build/sanitize ASAN_OPTIONS=detect_leaks=0 PYTHONMALLOC=malloc \
	LD_PRELOAD="$$(g++ -print-file-name=libasan.so) $$(g++ -print-file-name=libstdc++.so)"
# Libraries with one thread each, for speed: no result depends on it.
ONE_THREAD := OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1
FAST = $(ONE_THREAD) $(B)/python -m pytest -n 2 --dist worksteal --hypothesis-profile $(LAWS) --ignore tests/house \
	-m "not campaign and not mission and not tool"
ARM64_TESTS := $(if $(SHORT),$(addprefix tests/onboard/,native/test_elementary.py native/test_linear.py \
		kernel_calls/test_kernels.py kernel_calls/test_scip_kernel.py), \
	$(KERNEL_TESTS) $(addprefix tests/protocol/,link/test_link.py products/test_packing.py scip/test_scip.py products/test_space_packets.py link/test_transactions.py) \
	$(addprefix tests/onboard/,perception/scan/test_cloud.py motion/test_kinematics.py planning/local/test_poses.py record/test_record_replay.py perception/pose/test_registration.py))

.venv/.packages: requirements.lock tools/check_system.sh
	@sh tools/check_system.sh "$(PYTHON)"
	@echo "setting up .venv: once, some 400 MB of downloads; a minute or two, on a slow machine four, without a word"
	@$(PYTHON) -m venv --clear .venv
	@$(B)/python -m pip install --quiet --disable-pip-version-check --only-binary :all: --require-hashes -r requirements.lock
	@touch $@

.venv/.project: .venv/.packages $(NATIVE)
	@echo "building and installing the project: a minute, on a slow machine three"
	@$(B)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --editable .
	@$(B)/python -m compileall -q protocol transport onboard hil ground pictures
	@touch $@

.venv/.hokuyolx: .venv/.packages requirements-source.lock
	@echo "building hokuyolx, a client of the emulated scanner for tests and bench"
	@$(B)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --require-hashes -r requirements-source.lock
	@touch $@

setup: .venv/.project ## build and install everything into .venv: the commands onboard, hil, ground are in .venv/bin

demo: .venv/.project ## drive a rover across rocks to its goal; SEED=n, TERRAIN=real or craters, LIDAR="lost_ratio=0.03 ..."
	@$(B)/hil demo --seed $(SEED) --terrain $(TERRAIN) $(LIDAR:%=--lidar %)

sim: .venv/.project ## bench, rover and link in real time until Ctrl-C; try `ground` from another terminal
	@$(B)/hil sim --seed $(SEED) --terrain $(TERRAIN) $(LIDAR:%=--lidar %)

test: .venv/.project .venv/.hokuyolx .venv/.site ## the fast test suite (5 minutes on two fast cores)
	@$(FAST)

test-times: .venv/.project .venv/.hokuyolx .venv/.site ## the fast test suite, then its slowest tests and files by processor time
	@$(FAST) -p tests.times
	@$(B)/python -m tests.times

test-tools: .venv/.project .venv/.site ## tests of the test tools, packaging, viewers, pictures and the physics engine (2 minutes)
	@$(ONE_THREAD) $(B)/python -m pytest -n 2 --dist loadfile --ignore tests/house -m "tool and not campaign and not mission"

test-missions: .venv/.project ## runs of real processes, maps, guard and rule on seeded fields, ways with a failed wheel (minutes)
	@$(ONE_THREAD) $(B)/python -m pytest -n 2 --dist loadgroup -m "campaign or mission"

test-scenarios: .venv/.project ## whole missions with physics, each in one process; a few minutes, FULL=1 flies every seed
	@$(B)/python -m tests.scenarios $(if $(FULL),,--short)

test-vcan: .venv/.project ## the bus on real SocketCAN, in a QEMU guest where this kernel has none (minutes)
	@$(B)/python -m tests.vcan

test-roots: ## demo and fast suite in a fresh Debian 12 and the next, by an unprivileged user; needs root and mmdebstrap
	@sh tools/fresh_root.sh bookworm .venv/.project demo test
	@sh tools/fresh_root.sh trixie .venv/.project demo test
	@cmp build/roots/bookworm.certificate.json build/roots/trixie.certificate.json && echo "the same certificate"

test-certificates: .venv/.project ## demos of seeds 1 to 3 on three pretended processors: the same certificate; SEEDS="2 3"
	@$(B)/python -m tests.certificates $(foreach seed,$(SEEDS),--seed $(seed))
test-arm64: .venv/.project ## the flight program for ARM64 under qemu-user: kernels, a part of the suite, a drive, replays; SHORT=1
	@$(B)/python -m tests.arm64 $(ARM64_TESTS)

test-mutation: .venv/.project ## mutants: each fault detector disabled, comparisons and signs flipped; ONLY=kinematics in minutes
	@$(B)/python -m tests.mutation $(if $(ONLY),--only $(ONLY))

build/sanitize/.built: .venv/.packages $(NATIVE)
	@echo "building the kernels with sanitizers"
	@mkdir -p build/sanitize
	@$(B)/cmake -S . -B build/sanitize -G Ninja -DSANITIZE=ON -DCMAKE_BUILD_TYPE=Debug \
		-DCMAKE_MAKE_PROGRAM=$(abspath $(B))/ninja -DPython_EXECUTABLE=$(abspath $(B))/python \
		-Dnanobind_DIR=$$($(B)/python -m nanobind --cmake_dir) > build/sanitize.log
	@$(B)/ninja -C build/sanitize >> build/sanitize.log || { tail -20 build/sanitize.log; exit 1; }
	@touch $@

test-sanitize: .venv/.project build/sanitize/.built ## kernel tests and fuzz under ASan and UBSan, fuzz of SCIP, scanner and all doors, 2 min each
	@$(ONE_THREAD) $(SANITIZED) $(B)/python -m pytest $(KERNEL_TESTS)
	@$(ONE_THREAD) $(SANITIZED) $(B)/python -m tests.fuzz.kernels --seconds $(FUZZ_S) --seed $(SEED)
	@$(ONE_THREAD) $(B)/python -m tests.fuzz.scip --seconds $(FUZZ_S) --seed $(SEED)
	@$(ONE_THREAD) $(B)/python -m tests.fuzz.lidar --seconds $(FUZZ_S) --seed $(SEED)
	@$(ONE_THREAD) $(B)/python -m tests.fuzz --blind --in-all $(FUZZ_S) --seed $(SEED)

.venv/.atheris: .venv/.packages requirements-fuzz.lock
	@$(B)/python -m pip install --quiet --disable-pip-version-check --no-deps --only-binary :all: --require-hashes -r requirements-fuzz.lock
	@touch $@

fuzz: .venv/.project .venv/.atheris ## hostile bytes at every door, looking at the code they reach: FUZZ_S seconds a door, DOORS="can link"; SEED=n
	@$(ONE_THREAD) $(B)/python -m tests.fuzz $(DOORS) --seconds $(FUZZ_S) --seed $(SEED)

.venv/.browser: .venv/.packages requirements-browser.lock
	@$(B)/python -m pip install --quiet --disable-pip-version-check --no-deps --only-binary :all: --require-hashes -r requirements-browser.lock
	@touch $@

test-page: .venv/.project .venv/.browser ## the operator's page in a real Chromium, on a toy rover (minutes); ONLY="-k stop"; MINUTES=30 of memory; build/page
	@MINUTES=$(MINUTES) $(B)/python -m tests.page $(ONLY)

lint: .venv/.project ## ruff and its formatter, mypy --strict on protocol, transport and onboard, import contracts, rules of sources and pages
	@$(B)/ruff check .
	@$(B)/ruff format --check --quiet . || { echo "run: $(B)/ruff format ."; exit 1; }
	@$(B)/mypy
	@$(B)/lint-imports --no-cache
	@$(B)/python -m pytest tests/house

bench: .venv/.project .venv/.hokuyolx ## measure; QUICK=1 for two repeats; writes build/bench.json
	@$(ONE_THREAD) $(B)/python -m tests.bench $(if $(QUICK),--quick)

bench-link: .venv/.project ## the link's promises in virtual time, many seeds; QUICK=1 few, ONLY="bulk blackout"; build/bench-link.json
	@$(ONE_THREAD) $(B)/python -m tests.bench_link $(if $(QUICK),--quick) $(ONLY)

soak: .venv/.project ## ten missions in a row and an hour in lock-step, a minute on the wall clock: memory, descriptors, threads, ticks
	@$(ONE_THREAD) $(B)/python -m tests.soak

gate: .venv/.project ## may this version land? 20 flights against the committed baseline, 10 minutes; PLANT=guard_off must be red
	@$(B)/python -m tests.gate $(PLANT:%=--plant %)

missions: .venv/.project ## mission rule, guard, map and small rocks without physics; FRESH=commit: 60 more seeds
	@$(ONE_THREAD) $(B)/python -m tests.missions fly $(if $(FRESH),--fresh-from $(FRESH))
	@$(ONE_THREAD) $(B)/python -m tests.missions guard
	@$(ONE_THREAD) $(B)/python -m tests.missions map
	@$(ONE_THREAD) $(B)/python -m tests.missions rocks

nightly: LAWS := nightly
nightly: lint test test-tools test-missions test-vcan test-sanitize bench bench-link missions test-mutation ## all that tests or measures, with ten demo seeds, real ground, craters
	@for seed in 1 2 3 4 5 6 7 8 9 10; do $(B)/hil demo --seed $$seed --out build/nightly/seed-$$seed || echo "seed $$seed failed" >> build/nightly/failed; done
	@$(B)/hil demo --terrain real --out build/nightly/real
	@$(B)/hil demo --terrain craters --out build/nightly/craters
	@$(B)/hil tally build/nightly
	@$(MAKE) gate
	@$(B)/python -m tests.gate --prove
	@$(MAKE) fuzz FUZZ_S=600
	@$(MAKE) test-page MINUTES=30
	@$(MAKE) test-scenarios FULL=1
	@$(MAKE) test-certificates
	@if [ "$$(id -u)" = 0 ]; then $(MAKE) test-roots; else echo "without test-roots: it needs root"; fi
	@$(MAKE) test-arm64

codec: .venv/.project ## make the generated files in protocol/ again from rover.dbc and eldorado.xml
	@$(B)/python -m tools.make_can_codec
	@$(B)/python -m tools.make_can_frames
	@$(B)/python -m tools.make_dialect
	@$(B)/python -m tools.make_dissector

clients: .venv/.project ## MAVProxy for the tests of the gateway, into build/clients (29 MB to load, 124 MB on disk)
	@$(B)/python -m pip install --quiet --disable-pip-version-check --no-deps --only-binary :all: --require-hashes --upgrade --target build/clients -r requirements-clients.lock

docs: .venv/.project ## rebuild the pages made from tables, the notebook page's figures and the pictures
	@$(B)/python -m tools.make_docs
	@$(B)/python -m tools.make_notebook
	@$(B)/python -m tools.make_pictures

.venv/.site: .venv/.packages requirements-site.lock
	@$(B)/python -m pip install --quiet --disable-pip-version-check --no-deps --only-binary :all: --require-hashes -r requirements-site.lock
	@touch $@

site: .venv/.project .venv/.site ## the documentation as a site with search, for reading without a network: build/site/index.html
	@$(B)/python -m tools.site

$(ROVER)/.packages: requirements-build.lock requirements-onboard.lock
	@echo "setting up $(ROVER) (once; some minutes)"
	@"$(PYTHON)" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' || \
		{ echo "A rover needs Python 3.11 to 3.13: make PYTHON=/path/to/python3.12 rover" >&2; exit 1; }
	@"$(PYTHON)" -m venv --clear "$(ROVER)"
	@"$(ROVER)/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --only-binary :all: --require-hashes \
		-r requirements-build.lock -r requirements-onboard.lock
	@touch "$@"

$(ROVER)/.project: $(ROVER)/.packages $(NATIVE) $(shell git ls-files '*.py')
	@echo "building and installing the project"
	@"$(ROVER)/bin/python" -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --force-reinstall .
	@touch "$@"

rover: $(ROVER)/.project ## an environment in .rover with the extra `onboard` alone, Python 3.11 to 3.13; ROVER=folder

locks: .venv/.packages ## the locks of the extras anew from requirements.lock, with their sizes
	@$(B)/python -m tools.installation.extras

install: $(FLIES)/.project ## the flight program as a service: PREFIX=/usr/local, DESTDIR=, SYSCONFDIR=/etc, FLIES=.rover; docs/service.md
	@"$(FLIES)/bin/python" -m tools.installation.install install --prefix "$(PREFIX)" --destdir "$(DESTDIR)" --sysconfdir "$(SYSCONFDIR)"

uninstall: $(FLIES)/.project ## take it away again, with the same PREFIX; configuration, state and records stay
	@"$(FLIES)/bin/python" -m tools.installation.install uninstall --prefix "$(PREFIX)" --destdir "$(DESTDIR)" --sysconfdir "$(SYSCONFDIR)"

deb: $(FLIES)/.project ## the same as a Debian package in build/deb, for this machine's architecture
	@"$(FLIES)/bin/python" -m tools.installation.make_deb

size: ## lines of each package
	@git ls-files '*.py' '*.hpp' '*.cpp' | grep -v -e can_codec.py -e can_frames.py -e eldorado_dialect.py | xargs wc -l | sort -n | tail -40

clean: ## remove build and .venv
	@rm -rf build .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis

help: ## this list
	@grep -E '^[a-z0-9-]+:.*##' Makefile | sed 's/:.*## /\t/' | expand -t 16

.PHONY: setup demo sim test gate test-times test-tools test-missions test-scenarios test-vcan test-roots test-certificates test-arm64 test-page test-mutation test-sanitize fuzz lint bench bench-link soak missions nightly codec clients docs site rover locks install uninstall deb size clean help
