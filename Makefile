# Everything that a developer does. Needs Python 3.10 or newer, make and a package index; the tests of
# type support need a C compiler as well.
#
#   PYTHON=python3.12   the interpreter to use
#   ROS=no              do without the ROS 2 wheels (they exist for Linux on x86-64)
#   BROWSER=no          do without Chromium (the Debian package), which measures the pages of `idlc docs`
#                       and of the documentation site
#   EDITORS=no          do without Debian's neovim, emacs-nox and elpa-eglot, in which idlc lsp is tried
#   TOOLS=yes           fail where a tool for machine code is missing, instead of leaving a test out:
#                       elfutils, patchelf, valgrind, qemu-user, g++-aarch64-linux-gnu, libfastcdr1
#   WAYS='user root-gcc' the ways in which `make test-bare` runs the README's commands; all four otherwise
#   LOCKED=yes          install what maintenance/requirements/ names and no other, as CI does on Linux x86-64
#   JOBS=6              how many tests run at a time; `make quick` runs two more than there are cores
#   TIER=quick          which tests `make test`, test-all and test-lowest run (quick or test)
#   ARGS='-k name'      more words for pytest, or for the benchmarks
#   SEED=2              where `make fuzz` searches, and which mistakes `make mutants` makes
#   FUZZ=30             how many times as many inputs as `make test-long` does `make fuzz` try
#   N=80                how many mistakes `make mutants` makes

PYTHON ?= python3
ROS ?= $(if $(filter Linux-x86_64,$(shell uname -s)-$(shell uname -m)),yes,no)
BROWSER ?= $(if $(shell command -v chromium chromium-browser google-chrome 2>/dev/null),yes,no)
EDITORS ?= $(if $(and $(wildcard /usr/bin/nvim),$(wildcard /usr/bin/emacs)),yes,no)
LOCKED ?= no
INTERPRETERS ?= 3.10 3.11 3.12 3.13 3.14
# Few of the quick tests wait, and each process collects all tests first.
JOBS ?= $(if $(filter quick,$(MAKECMDGOALS)),$(shell expr 2 + $$(getconf _NPROCESSORS_ONLN)),6)
TIER ?= test
ARGS ?=
FUZZ ?= 30
SEED ?= 2
N ?= 80

TAG := $(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')
KIND := $(TAG)$(if $(filter yes,$(LOCKED)),-locked)
TEST_ENV := .venv/test-$(KIND)$(if $(filter no,$(ROS)),-without-ros)
KILTED_ENV := .venv/kilted-$(KIND)
ROBOT_ENV := .venv/robot-$(KIND)
LOWEST_ENV := .venv/lowest-$(TAG)
BENCH_ENV := $(if $(filter no,$(ROS)),$(TEST_ENV),.venv/bench-$(TAG))
# no lock is for the demonstration alone
DEMO_ENV := $(if $(filter yes,$(LOCKED)),$(TEST_ENV),.venv/demo-$(TAG)$(if $(filter no,$(ROS)),-without-ros))
SITE_ENV := $(if $(filter no,$(ROS)),.venv/site-$(TAG),$(TEST_ENV))
RELEASE_ENV := .venv/release-$(KIND)
LOCK_ENV := .venv/lock-$(TAG)
DEMO_OUT := build/demo
VSCODE := build/vscode
TEST_EXTRA := $(if $(filter no,$(ROS)),test,test-ros)
WITHOUT_ROS := --ignore=tests/ros --ignore=tests/website -m 'not ros'
BROWSER_TESTS := tests/tasks/test_docs_browser.py tests/website/test_website_browser.py \
    tests/website/test_playground_browser.py tests/website/test_accessibility.py
WITHOUT_BROWSER := $(if $(filter no,$(BROWSER)),$(BROWSER_TESTS:%=--ignore=%))
WITHOUT_EDITORS := $(if $(filter no,$(EDITORS)),--ignore=tests/editors/test_debian.py)
SELECTION := $(if $(filter no,$(ROS)),$(WITHOUT_ROS)) $(WITHOUT_BROWSER) $(WITHOUT_EDITORS)
PARALLEL = -n $(JOBS) --dist worksteal
PYTEST = $(TEST_ENV)/bin/python -m pytest $(PARALLEL)

PIP_INSTALL = -m pip install --quiet --disable-pip-version-check
# One file of versions and hashes per environment, and first the one that builds and installs packages.
LOCKS := build release test-ros test-kilted test-robot test-lowest
UV_COMPILE = $(LOCK_ENV)/bin/uv pip compile --quiet --universal --python-version 3.10 --upgrade \
    --generate-hashes --no-annotate --custom-compile-command 'make lock'
# Nothing that we run leaves this machine, or this folder: rclpy stops where it cannot write its logs.
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
export ROS_LOG_DIR := $(CURDIR)/build/log
# PYTHONPATH would come before the packages of each environment. Without bytecode, each of the thousands of
# programs that tests start would compile all that it imports.
unexport PYTHONPATH PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help install environment demo quick test test-long costs mutants test-bare test-kilted test-robot test-all test-lowest vscode test-vscode fuzz soak lint example bench \
    lock site playground release-check runtime-wheel clean

help: ## show this list
	@echo 'make TARGET, where TARGET is'
	@sed -n 's/^\([a-z-]*\):.*## /  \1 \t/p' $(firstword $(MAKEFILE_LIST)) | expand -t 14

install: $(DEMO_ENV)/installed $(TEST_ENV)/installed ## prepare what demo and test need; neither needs a network then

environment: $(TEST_ENV)/installed ## prepare what the tests need

demo: $(DEMO_ENV)/installed ## compile the example; publish, call and act with it in the real rclpy, or without ROS
	@echo '$$ idlc gen examples/my_robot_controller -o $(DEMO_OUT)/my_robot_controller'
	@$(DEMO_ENV)/bin/idlc gen examples/my_robot_controller -o $(DEMO_OUT)/my_robot_controller
ifeq ($(ROS),no)
	@PYTHONPATH=$(DEMO_OUT) $(DEMO_ENV)/bin/python -m idlc.robot examples/demo.py
else
	@$(DEMO_ENV)/bin/idlc gen $(DEMO_ENV)/share/std_msgs --package std_msgs_by_idlc -o $(DEMO_OUT)/std_msgs_by_idlc
	@PYTHONPATH=$(DEMO_OUT) $(DEMO_ENV)/bin/python examples/demo.py
endif

quick: $(TEST_ENV)/installed ## run the tests that take at most 0.1 CPU-seconds each, while you edit
	$(PYTEST) --tier quick $(SELECTION) $(ARGS)

test: $(TEST_ENV)/installed ## run the tests
ifeq ($(ROS),no)
	@echo 'without the ROS 2 wheels: the tests marked "ros" and those of the site are left out'
endif
ifeq ($(BROWSER),no)
	@echo 'without Chromium: left out are $(BROWSER_TESTS)'
endif
ifeq ($(EDITORS),no)
	@echo 'without Neovim and Emacs of Debian: tests/editors/test_debian.py is left out'
endif
	$(PYTEST) --tier $(TIER) $(SELECTION) $(ARGS)

test-long: $(TEST_ENV)/installed ## run the tests that take long, and random ones with more inputs
	$(PYTEST) --tier long $(SELECTION) $(ARGS)

costs: $(TEST_ENV)/installed ## measure all tests, and write those that are not quick into tests/costs.tsv
	rm -rf build/costs
	-$(PYTEST) --costs=build/costs/first $(ARGS)
	$(TEST_ENV)/bin/python -m tests.support.costs build/costs/first --repeat build/costs/again.json
	-$(PYTEST) --costs=build/costs/second --only=build/costs/again.json $(ARGS)
	$(TEST_ENV)/bin/python -m tests.support.costs build/costs/first build/costs/second

mutants: $(TEST_ENV)/installed ## make N small mistakes in idlc, chosen by SEED, and see which tests notice them
	$(TEST_ENV)/bin/python $(PIP_INSTALL) coverage
	$(TEST_ENV)/bin/python -m maintenance.mutants --number $(N) --seed $(SEED) $(ARGS)

test-bare: ## run the commands of the README on a bare Debian: as root and a user, with gcc and without
	BARE_ARGS="$(ARGS)" sh tests/repository/bare.sh $(WAYS)

test-kilted: $(KILTED_ENV)/installed ## run the tests of what works with ROS 2 on the wheels of Kilted
	$(KILTED_ENV)/bin/python -m pytest $(PARALLEL) -m 'not jazzy' tests/ros $(ARGS)

test-robot: $(ROBOT_ENV)/installed ## run idlc.robot with pyzeros and zenoh-ros2-sdk (needs a C compiler)
	IDLC_PEERS=1 CYDR_CACHE_DIR=$(CURDIR)/build/cydr $(ROBOT_ENV)/bin/python -m pytest tests/robot/test_peers.py $(ARGS)

test-all: ## run the tests on every interpreter in INTERPRETERS that is present
	@PYTHON=$(PYTHON) sh tests/repository/every_python.sh $(INTERPRETERS)

test-lowest: ## run the tests that need no ROS with the lowest versions that pyproject.toml allows
	@$(MAKE) --no-print-directory LOCKED=yes EXTRA=test-lowest $(LOWEST_ENV)/installed
	$(LOWEST_ENV)/bin/python -m pytest $(PARALLEL) --tier $(TIER) $(WITHOUT_ROS) $(WITHOUT_BROWSER) \
	    $(WITHOUT_EDITORS) $(ARGS)

vscode: ## build the extension for VS Code, build/idlc.vsix (needs Node 20 or newer)
	@mkdir -p build
	cd editors/vscode && npm ci && npm run check && npm test && npm run build && npm run package
	$(PYTHON) -m maintenance.release extension build/idlc.vsix

test-vscode: $(TEST_ENV)/installed vscode ## try the extension in a real VS Code; save pictures of it
	@mkdir -p $(VSCODE)
	cp tests/editors/vscode/* tests/editors/vscode/.npmrc $(VSCODE)
	cd $(VSCODE) && npm ci && npm run prepare-server
	$(TEST_ENV)/bin/python -m pytest tests/editors/vscode_check.py $(ARGS)

fuzz: $(TEST_ENV)/installed ## search for input that breaks idlc, for an hour or more
	IDLC_ROUNDS=$(FUZZ) IDLC_SEED=$(SEED) \
	    $(TEST_ENV)/bin/python -m pytest --timeout 0 -n $(JOBS) $(SELECTION) tests/hardening/test_fuzz.py \
	    tests/hardening/test_fuzz_recordings.py tests/recordings/test_hostile_containers.py \
	    tests/hardening/test_limits.py tests/runtime/test_hostile.py tests/robot/test_hostile.py \
	    tests/robot/test_node_hostile.py \
	    $(if $(filter no,$(ROS)),,tests/ros/test_verdict_live.py) $(ARGS)
	@if $(TEST_ENV)/bin/python $(PIP_INSTALL) atheris; then \
	    for target in $$($(TEST_ENV)/bin/python -c \
	        'from tests.support.fuzzing import TARGETS; print(*TARGETS)'); do \
	        $(TEST_ENV)/bin/python -m tests.hardening.fuzz_atheris $$target 300 || exit 1; \
	    done; \
	else echo 'atheris has no build for this Python: its part is left out'; fi

soak: $(TEST_ENV)/installed ## send a million messages through rclpy
	IDLC_ROUNDS=100 $(TEST_ENV)/bin/python -m pytest --timeout 0 tests/ros/test_load.py $(ARGS)

lint: $(TEST_ENV)/installed ## check style and types
	$(TEST_ENV)/bin/ruff check .
	$(TEST_ENV)/bin/ruff format --check .
	$(TEST_ENV)/bin/mypy

example: $(TEST_ENV)/installed ## compile the committed example again
	cd examples/my_robot_controller && $(CURDIR)/$(TEST_ENV)/bin/python -m idlc gen

bench: $(BENCH_ENV)/installed ## measure against all peers; ARGS='--help' says what else it can do
	@$(BENCH_ENV)/bin/python -m benchmarks --json build/benchmarks.json $(ARGS)

site: $(SITE_ENV)/installed ## write the documentation site into build/site
	$(SITE_ENV)/bin/python -m maintenance.website build/site

playground: $(SITE_ENV)/installed ## write the playground into build/site/playground (needs Node 20 or newer)
	$(SITE_ENV)/bin/python -m maintenance.playground build/site/playground

release-check: $(RELEASE_ENV)/installed ## rehearse a release: archives, metadata, workflows
	$(RELEASE_ENV)/bin/python -m maintenance.release check $(ARGS)

runtime-wheel: $(TEST_ENV)/installed ## build idlc-runtime, what packages with runtime = "installed" import, into dist/
	$(TEST_ENV)/bin/python -m build --outdir dist maintenance/runtime

lock: ## choose the versions for CI again, and write down their hashes
	@$(PYTHON) -m venv $(LOCK_ENV)
	@$(LOCK_ENV)/bin/python $(PIP_INSTALL) 'uv>=0.8'
	$(UV_COMPILE) pyproject.toml --extra test-ros --output-file maintenance/requirements/test-ros.txt
	$(UV_COMPILE) pyproject.toml --extra test-kilted --output-file maintenance/requirements/test-kilted.txt
	$(UV_COMPILE) pyproject.toml --extra test-robot --output-file maintenance/requirements/test-robot.txt
	$(UV_COMPILE) pyproject.toml --extra test --resolution lowest-direct \
	    --output-file maintenance/requirements/test-lowest.txt
	printf 'setuptools>=77\nuv>=0.8\n' | $(UV_COMPILE) - --constraints maintenance/requirements/test-ros.txt \
	    --output-file maintenance/requirements/build.txt
	$(UV_COMPILE) pyproject.toml --extra release --constraints maintenance/requirements/build.txt \
	    --output-file maintenance/requirements/release.txt

clean: ## remove environments and everything that was built
	rm -rf .venv build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . \( -name __pycache__ -o -name .ruff_cache \) -type d -prune -exec rm -rf {} +

$(TEST_ENV)/installed: EXTRA := $(TEST_EXTRA)
$(KILTED_ENV)/installed: EXTRA := test-kilted
$(ROBOT_ENV)/installed: EXTRA := test-robot
$(BENCH_ENV)/installed: EXTRA := $(if $(filter no,$(ROS)),test,bench)
$(if $(filter-out yes,$(LOCKED)),$(DEMO_ENV)/installed: EXTRA := $(if $(filter no,$(ROS)),recordings,ros))
$(SITE_ENV)/installed: EXTRA := $(if $(filter no,$(ROS)),docs,test-ros)
$(RELEASE_ENV)/installed: EXTRA := release

# One pip call per environment: the resolver sees everything at once. An environment that is
# there already is brought up to date. A lock names everything, so pip resolves nothing (--no-deps):
# some versions of pip reject a lock when a newer release of a package with extras comes out.
.venv/%/installed: pyproject.toml $(LOCKS:%=maintenance/requirements/%.txt)
	@echo 'preparing .venv/$* ...'
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10) and "idlc needs Python 3.10 or newer, $(PYTHON) is " + sys.version)'
	@$(PYTHON) -m venv .venv/$*
ifeq ($(LOCKED),yes)
	@.venv/$*/bin/python $(PIP_INSTALL) --require-hashes --requirement maintenance/requirements/build.txt
	@.venv/$*/bin/uv pip install --quiet --python .venv/$*/bin/python --require-hashes --no-build-isolation \
	    --no-deps --requirement maintenance/requirements/$(EXTRA).txt
	@.venv/$*/bin/python $(PIP_INSTALL) --no-deps --no-build-isolation --editable .
else
	@.venv/$*/bin/python $(PIP_INSTALL) --editable '.[$(EXTRA)]' || { \
	    echo >&2; \
	    echo 'The environment could not be made. If pip found no ros-jazzy-* build for this' >&2; \
	    echo 'interpreter ($(PYTHON), $(TAG)), name another one with PYTHON=..., or say ROS=no' >&2; \
	    echo 'to run the tests that need no ROS.' >&2; \
	    exit 1; }
endif
	@# compile what tests import once, before several processes do it at the same time
	@.venv/$*/bin/python -m pytest --collect-only --quiet >/dev/null 2>&1 || true
	@touch $@
