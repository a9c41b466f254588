# `make help` shows what can be asked for. Nothing here is installed outside `.venv`, `.venv-peers` and `.venv-dreamer`.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

PYTHON ?= python3
PYTEST_ARGS ?=

VENV := .venv
BIN := $(VENV)/bin
# Outside programs that tests compare with, and the simulator Basilisk: what they need may contradict our own locks.
PEERS := .venv-peers
# DreamerV3 by sheeprl, which `fulmar train --algorithm dreamer` runs: what it needs contradicts our own lock.
DREAMER := .venv-dreamer
# The builder of the documentation site, which nothing else needs.
SITE := .venv-docs
RUN_LOCK := requirements.lock
DEV_LOCK := requirements-dev.lock
PEERS_LOCK := requirements-peers.lock
DREAMER_LOCK := requirements-dreamer.lock
DOCS_LOCK := requirements-docs.lock
# Of the images that are not made from the run lock.
ROBOT_LOCK := docker/requirements-robot.lock
TRAIN_LOCK := docker/requirements-train.lock
# Lies beside what it builds, so that the wheel has it too.
MESSAGES_LOCK := ros2_ws/src/fulmar_bringup/fulmar_bringup/tf2_msgs/requirements.lock
# Of .venv after an install on x86-64 [MiB], measured by `du -s --block-size=1M .venv`; the last two of
# .venv-peers and .venv-dreamer.
RUN_SIZE := 884
DEV_SIZE := 8217
PEERS_SIZE := 8838
DREAMER_SIZE := 6209

# A sourced ROS shell puts its own packages before those of .venv; the two must not mix.
unexport PYTHONPATH
# Tests start hundreds of processes, which would all compile the same modules again.
unexport PYTHONDONTWRITEBYTECODE

# A stamp has the checksum of its lock file: a changed lock needs a new installation, a touched one does not.
key = $(firstword $(shell cat $(1) pyproject.toml | cksum))
RUN_STAMP := $(VENV)/.run-$(call key,$(RUN_LOCK))
DEV_STAMP := $(VENV)/.dev-$(call key,$(DEV_LOCK))
TF_STAMP := $(VENV)/.tf-$(firstword $(shell cksum < $(MESSAGES_LOCK)))
INTERFACES := $(wildcard $(addprefix ros2_ws/src/fulmar_bringup/fulmar_bringup/,nav2_msgs/action/* \
	simulation_interfaces/msg/* simulation_interfaces/srv/* simulation_interfaces/action/* control_msgs/msg/* \
	px4_msgs/msg/*))
INTERFACES_STAMP := $(VENV)/.interfaces-$(firstword $(shell cat $(MESSAGES_LOCK) $(INTERFACES) | cksum))
STARS_LOCK := ros2_ws/src/fulmar_bringup/fulmar_bringup/stars/requirements.lock
STARS_STAMP := $(VENV)/.stars-$(firstword $(shell cksum < $(STARS_LOCK)))
# Elsewhere ROS does not come as wheels, and its own tf2_msgs comes with it.
HAS_ROS_WHEELS := $(filter Linux-x86_64,$(shell uname -s)-$(shell uname -m))
# Nothing of ours is installed in these, so their locks alone count.
PEERS_STAMP := $(PEERS)/.peers-$(firstword $(shell cksum < $(PEERS_LOCK)))
DREAMER_STAMP := $(DREAMER)/.dreamer-$(firstword $(shell cksum < $(DREAMER_LOCK)))

# Turns pip's long log into one line that counts: on a terminal it rewrites itself, in a log every tenth is kept.
# Errors go past it unchanged. Arguments: lock, size [MiB], environment.
define install_lock
total=$$(grep -c '==' $(1)); \
echo "Installing from $(1): at most $$total packages, exact versions, hashes checked."; \
free=$$(df -BM --output=avail . | tail -n 1 | tr -dc 0-9); \
echo "$(3) takes $(2) MiB; $$free MiB are free on this disk."; \
if [ "$$free" -lt $(2) ]; then echo "Less is free than an install from nothing takes: make room, or stop with Ctrl-C." >&2; fi; \
PYTHONUNBUFFERED=1 $(3)/bin/python -m pip install --disable-pip-version-check --no-input --progress-bar off \
	--require-hashes -r $(1) | { \
	seen=0; \
	while read -r verb what rest; do case "$$verb" in \
		Collecting|Requirement) seen=$$((seen + 1)); \
			if [ -t 1 ]; then printf '\r\033[K  %3d/%d %s' "$$seen" "$$total" "$${what%%==*}"; \
			elif [ $$((seen % 10)) = 0 ]; then printf '  %3d/%d\n' "$$seen" "$$total"; fi ;; \
		Downloading|Using) if [ -t 1 ]; then printf ' %s' "$${rest##* (}" | tr -d ')'; fi ;; \
		Building) printf '\n  building %s\n' "$$rest" ;; \
		Installing) printf '\n  unpacking, this takes a moment\n' ;; \
	esac; done; }
endef

# The same in an environment where nothing of ours is: the pip of the lock comes first. Same arguments.
define install_apart
$(3)/bin/python -m pip install --disable-pip-version-check --no-input --quiet --require-hashes \
	-r <(awk '/^pip==/, !/\\$$/' $(1)); \
$(call install_lock,$(1),$(2),$(3))
endef

# hatchling and editables are in both locks, so that this step needs neither network nor build isolation.
install_fulmar = $(BIN)/python -m pip install --disable-pip-version-check --quiet --no-deps --no-build-isolation -e .

.PHONY: help
help: ## Show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' Makefile
	@echo
	@echo "  PYTHON=python3.12    interpreter of .venv (3.11 to 3.14)"
	@echo "  EXTRA='jsbsim gym'   extras that 'make with' adds: cluster datasets events gym jsbsim pettingzoo train wandb"
	@echo "  PYTEST_ARGS='-k lqr' more arguments for pytest in 'make test'"

.PHONY: setup
setup: $(RUN_STAMP) ## Install what a robot or a simulation needs (no torch; 0.9 GiB)

.PHONY: tf
tf: $(RUN_STAMP) $(TF_STAMP) ## Build the message package of /tf, for RViz and Foxglove (needs a C++ compiler)

.PHONY: with
with: $(RUN_STAMP) ## Add an extra of pyproject.toml, without the rest of `make dev`: make with EXTRA=jsbsim
	@$(BIN)/python -m fulmar_cli.installation.add_extra $(EXTRA)

.PHONY: dev
dev: $(DEV_STAMP) $(if $(HAS_ROS_WHEELS),$(TF_STAMP) $(INTERFACES_STAMP)) $(STARS_STAMP) ## Install everything, also for training and tests (8.0 GiB)

.PHONY: peers
peers: $(PEERS_STAMP) ## Install Basilisk and the outside programs that tests compare with, into .venv-peers (8.6 GiB)

.PHONY: dreamer
dreamer: $(DREAMER_STAMP) ## Install DreamerV3, which learns policies, into .venv-dreamer (6.1 GiB)

$(VENV)/bin/python $(PEERS)/bin/python $(DREAMER)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' || { \
		echo "'$(PYTHON)' is $$($(PYTHON) --version 2>&1 || true), but Fulmar needs Python 3.11, 3.12, 3.13 or 3.14." >&2; \
		echo "Name one that you have: make $(or $(MAKECMDGOALS),setup) PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -m venv $(@:/bin/python=) || { rm -rf $(@:/bin/python=); \
		echo "'$(PYTHON) -m venv' failed, see above. On Debian and Ubuntu: apt install python3-venv" >&2; exit 1; }

$(RUN_STAMP): | $(VENV)/bin/python
	@$(call install_lock,$(RUN_LOCK),$(RUN_SIZE),$(VENV))
	@$(install_fulmar)
	@rm -f $(VENV)/.run-*
	@touch $@
	@echo "Ready: $(BIN)/fulmar"

# The development lock contains the run-time lock, version for version, so it sets both stamps.
$(DEV_STAMP): | $(VENV)/bin/python
	@$(call install_lock,$(DEV_LOCK),$(DEV_SIZE),$(VENV))
	@$(install_fulmar)
	@rm -f $(VENV)/.run-* $(VENV)/.dev-*
	@touch $@ $(RUN_STAMP)
	@echo "Ready: $(BIN)/fulmar, with training and the tools for tests"

# Needs an environment with ROS, which the run stamp and the dev stamp make alike.
$(TF_STAMP): | $(RUN_STAMP)
	@$(BIN)/fulmar install-tf
	@rm -f $(VENV)/.tf-*
	@touch $@

$(INTERFACES_STAMP): | $(RUN_STAMP)
	@$(BIN)/fulmar install-interfaces
	@rm -f $(VENV)/.interfaces-*
	@touch $@

$(STARS_STAMP): | $(RUN_STAMP)
	@$(BIN)/fulmar install-stars
	@rm -f $(VENV)/.stars-*
	@touch $@

$(PEERS_STAMP): | $(PEERS)/bin/python
	@$(call install_apart,$(PEERS_LOCK),$(PEERS_SIZE),$(PEERS))
	@rm -f $(PEERS)/.peers-*
	@touch $@
	@echo "Ready: $(PEERS), with the outside programs that tests compare with"

$(DREAMER_STAMP): | $(DREAMER)/bin/python
	@$(call install_apart,$(DREAMER_LOCK),$(DREAMER_SIZE),$(DREAMER))
	@rm -f $(DREAMER)/.dreamer-*
	@touch $@
	@echo "Ready: $(DREAMER), for fulmar train --algorithm dreamer"

.PHONY: demo
demo: setup ## Run the floating platform with a policy, then with an LQR, over ROS 2
	@$(BIN)/fulmar demo

.PHONY: train-demo
train-demo: dev ## Train a policy, export it and evaluate it in MuJoCo
	$(BIN)/fulmar train floating_platform go_to_pose --seed 1 --out runs/train/go_to_pose
	$(BIN)/fulmar export runs/train/go_to_pose --out runs/bundles/go_to_pose
	$(BIN)/fulmar evaluate floating_platform go_to_pose --controller policy --policy runs/bundles/go_to_pose \
		--through mujoco --episodes 256

.PHONY: policies
policies: dev ## Make the shipped policies that are missing or out of date (under 90 minutes on two cores)
	$(BIN)/fulmar policies

.PHONY: envelopes
envelopes: dev ## Test the certified sets of the shipped policies again, on today's core (10 minutes on two cores)
	for passport in $$(grep -l '"envelope"' policy_server/policies/*/passport.json); do \
		$(BIN)/fulmar certify $$(dirname $$passport) --again --write || exit 1; done

.PHONY: replay-bags
replay-bags: dev ## Record the reference bags of the tests again, after an intended change of behaviour
	$(BIN)/fulmar bag reference tests/replay/bags --update

.PHONY: freeze-check
freeze-check: dev ## Compare gains, commands, observations, batches, runs and benchmarks with the frozen ones
	$(BIN)/fulmar bag reference tests/replay/bags
	$(BIN)/python -m tests.freeze

.PHONY: rooms
rooms: dev ## Print the rooms of the core, and which folders import each other
	$(BIN)/python -m tests.architecture.rooms

.PHONY: freeze
freeze: dev ## Freeze them anew, after an intended change of behaviour
	$(BIN)/python -m tests.freeze --update

# Three processes, since tests of nodes mostly wait. Those with wall-clock deadlines come first, and beside them only
# what takes nothing from them, see tests/real_time_first.py.
define run_tests
if $(BIN)/python -m pytest tests -n 3 --dist loadfile $(1) $(PYTEST_ARGS); then echo; echo "All tests passed."; \
else code=$$?; echo; \
	echo "Some tests failed, or none was found. To repeat the failed ones: make test PYTEST_ARGS=--last-failed" >&2; \
	exit $$code; fi
endef

.PHONY: test
test: dev ## Run the tests, without those that take over 1.5 s of processor time
	@$(call run_tests,-m "not slow")

.PHONY: test-all
test-all: dev peers dreamer setup-browser ## Run every test
	@$(call run_tests,)

.PHONY: mutants
mutants: dev ## Take each guard away in turn, and run the test that must fail then (MUTANTS="--only estop-latches")
	@$(BIN)/python -m tests.mutants $(MUTANTS)

.PHONY: profile-step
profile-step: dev ## Profile a control step and its lock step (AGAINST=DIR: compare with another checkout)
	@$(BIN)/python tests/benchmarks/profile_step.py $(if $(AGAINST),--against $(AGAINST))

.PHONY: check
check: dev ## Check format, lint, types, import contracts, spelling and container files
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(BIN)/codespell
	$(BIN)/hadolint docker/*Dockerfile
	$(BIN)/podman-compose --dry-run --file docker/compose.yaml --profile sim --profile hardware --profile split \
		--profile train config > /dev/null
	@echo "All checks passed."

.PHONY: images
images: ## Build the container images, by docker, podman or buildah (TARGETS="robot sim train")
	docker/build.sh $(TARGETS)

.PHONY: format
format: dev ## Format the sources and apply the safe fixes of the linter
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

.PHONY: ros-build
ros-build: dev ## Build the ROS workspace with colcon, into ros2_ws/{build,install,log}
	cd ros2_ws && PATH="$$PWD/../$(BIN):$$PATH" ../$(BIN)/colcon build --base-paths src

# Universal: one file serves Python 3.11 to 3.14. Neither command nor index is written into it. Extras stay: pip before
# 23.3 does not see that `coverage` is pinned where `coverage[toml]` is wanted, and takes the newest.
compile = $(BIN)/uv pip compile --universal --python-version 3.11 --fork-strategy fewest \
	--generate-hashes --no-strip-extras --no-header --no-annotate --quiet

.PHONY: lock
lock: $(DEV_STAMP) ## Make the locks anew (UPGRADE=1 takes the newest versions)
	$(compile) $(if $(UPGRADE),--upgrade) pyproject.toml --extra run --group build --output-file $(RUN_LOCK)
	$(compile) $(if $(UPGRADE),--upgrade) pyproject.toml --all-extras --group dev --constraint $(RUN_LOCK) \
		--output-file $(DEV_LOCK)
	$(compile) $(if $(UPGRADE),--upgrade) pyproject.toml --extra ros --extra policy --extra bags --extra hardware --extra console \
		--group build --constraint $(RUN_LOCK) --output-file $(ROBOT_LOCK)
	cp $(DEV_LOCK) $(TRAIN_LOCK) # its versions are taken where they fit
	$(compile) pyproject.toml --extra ros --extra sim --extra policy --extra bags --extra view --extra train --group build \
		--output-file $(TRAIN_LOCK)
	$(compile) $(if $(UPGRADE),--upgrade) --group peers --output-file $(PEERS_LOCK)
	cp $(DEV_LOCK) $(DREAMER_LOCK) # likewise
	$(compile) --group dreamer --output-file $(DREAMER_LOCK)
	$(compile) $(if $(UPGRADE),--upgrade) --group docs --output-file $(DOCS_LOCK)
	$(compile) $(if $(UPGRADE),--upgrade) --group messages --constraint $(RUN_LOCK) --output-file $(MESSAGES_LOCK)

$(SITE)/bin/zensical: $(DOCS_LOCK)
	@$(PYTHON) -m venv $(SITE)
	@$(SITE)/bin/python -m pip install --disable-pip-version-check --no-input --quiet --require-hashes -r $(DOCS_LOCK)
	@touch $@

.PHONY: site
site: $(SITE)/bin/zensical ## Build the documentation site into site/, strictly
	@$(SITE)/bin/zensical build --clean --strict

.PHONY: site-serve
site-serve: $(SITE)/bin/zensical ## Serve the documentation site on this computer, anew at each change
	@$(SITE)/bin/zensical serve

.PHONY: console-vendor
console-vendor: ## Bundle three.js and uPlot for the console's page anew (npm)
	ros2_ws/src/fulmar_console/vendor/build.sh

.PHONY: setup-browser
setup-browser: ## Install the browser in which the console's page is tested (Debian's Chromium, by apt-get)
	@if command -v chromium > /dev/null && ldconfig -p | grep -q libEGL.so.1; then echo "Chromium is there."; \
	elif [ "$$(id -u)" = 0 ]; then apt-get update -qq; \
		apt-get install -y -qq --no-install-recommends chromium libegl1 libgl1-mesa-dri fonts-dejavu-core; \
	else echo "As root: apt-get install chromium libegl1 libgl1-mesa-dri fonts-dejavu-core" >&2; exit 1; fi

.PHONY: clean
clean: ## Remove what was built and cached; .venv, .venv-peers, .venv-dreamer and runs/ stay
	rm -rf build dist ros2_ws/build ros2_ws/install ros2_ws/log
	rm -rf .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -not -path './$(VENV)/*' -not -path './$(PEERS)/*' \
		-not -path './$(DREAMER)/*' -prune -exec rm -rf {} +
