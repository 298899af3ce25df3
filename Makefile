# Everything from a bare machine with python3 (3.11 or newer), a C++17 compiler and make.
#
#   make demo            home the simulated arm and let it carry a plate from one nest to another
#   make test            the tests in at most 5 minutes of two cores; of those with ROS 2 and of the page in
#                        a browser a few, where these are installed
#   make test-all        all tests: these, those that take long, all with ROS 2, which it installs, once more with Python 3.12,
#                        all of the page in a browser, firmware-check, release-check and arm-check
#   make check           what CI runs besides the tests: lint, types, layers, generated files
#   make format          the form that lint checks, of Python and of the page's JavaScript
#   make firmware        the images of the four joints: firmware/build/j1.elf, j1.bin, j1.map ...
#   make dist            a release: wheels, sdists, images of the joints, checksums
#   make release-check   a release: built twice, judged, installed with each Python here, and used
#   make arm-check       the same on emulated arm64, the arm's own kind of computer, compared bit for bit
#   make firmware-check  the joint firmware: host tests under sanitizers, the images on an emulated board
#   make bench           the benchmarks; writes docs/benchmarks.md
#   make docs            the documentation as a site, with the reference, into site/
#   make laws            the laws over random moves, switches and faults, at their full number
#   make mutants         remove each guard once and require a red test
#   make ros2            an environment with ROS 2 from PyPI and our interface packages, in .venv-ros2
#   make lock            the files in locks/: the versions of constraints.txt with their hashes
#   make generate        what follows from the register table and the parameters
#   make clean           remove the environments and all that was built; runs and faults stay
#
# All of it is installed into .venv. For another Python: make clean, then make PYTHON=python3.13.

PYTHON ?= python3
VENV ?= .venv
ROS2 ?= .venv-ros2
BIN := $(VENV)/bin
EMULATED := tests/firmware/test_emulat*.py
PIP := $(BIN)/python -m pip --disable-pip-version-check
# On a terminal pip shows what it does: the two steps take half a minute.
QUIET := $$([ -t 2 ] || echo --quiet)
NATIVE := firmware/pyproject.toml $(shell find firmware/sim firmware/joint/src -type f \
            \( -name '*.cpp' -o -name '*.h' -o -name 'CMakeLists.txt' -o -name '*.toml' -o -name '*.py*' \) \
            -not -path '*/build/*' -not -path '*/__pycache__/*' 2>/dev/null)

# Without bytecode each program that a test starts, and there are hundreds, takes twice as long to begin.
unexport PYTHONDONTWRITEBYTECODE

# An environment works only where it was made: in a folder that was moved it is made anew.
MOVED := $(shell cd '$(VENV)' 2>/dev/null && [ -s .created ] && [ "$$(cat .created)" != "$$(pwd -P)" ] && echo moved)

.PHONY: $(if $(MOVED),$(VENV)/.created)
.PHONY: demo test test-all ros-tests-312 page-tests check lint format types layers fresh firmware firmware-check dist release-check arm-check bench docs laws soak page-soak mutants ros2 generate lock clean
.DEFAULT_GOAL := demo

$(VENV)/.created: Makefile
	@$(PYTHON) -c 'import sys; v = "%d.%d" % sys.version_info[:2]; sys.exit(sys.version_info < (3, 11) and "bioscara needs Python 3.11 or newer; $(PYTHON) is " + v + ": make PYTHON=/path/to/python3.11")'
	@echo "1 of 3: creating the environment $(VENV)"
	@$(PYTHON) -m venv $(if $(MOVED),--clear) $(VENV) || { echo "cannot create $(VENV): on Debian and Ubuntu, apt install python3-venv" >&2; exit 1; }
	@(cd $(VENV) && pwd -P) >$@

# Packages of others come from the files in locks/, each file of them with its hash, also what builds; then what is
# here, for which pip knows no hash, without the packages that it needs.
LOCKED := $(PIP) install --require-hashes
OURS := $(PIP) install --no-deps --no-build-isolation
# Packages of which the newest version is taken in place of the locked one: make NEWEST=numpy test.
NEWEST ?=

$(VENV)/.locked: $(VENV)/.created locks/demo.txt
	@echo "2 of 3: installing the packages that bioscara needs"
	@$(LOCKED) $(QUIET) --only-binary :all: -r locks/demo.txt
	@touch $@

$(VENV)/.native: $(VENV)/.locked $(NATIVE)
	@command -v c++ >/dev/null || { echo "no C++ compiler: on Debian and Ubuntu, apt install g++" >&2; exit 1; }
	@echo "3 of 3: compiling the firmware for the simulated arm, and installing bioscara"
	@$(OURS) $(QUIET) ./firmware
	@touch $@

$(VENV)/.demo: $(VENV)/.native pyproject.toml
	@$(OURS) $(QUIET) -e .
	@touch $@

$(VENV)/.dev: $(VENV)/.demo pyproject.toml locks/dev.txt
	@echo "installing the tools for tests and checks"
	@# Not of wheels alone: ruckig has none for arm64, where its source has a hash, and what builds it has none.
	@$(LOCKED) --quiet -r locks/dev.txt
	@$(if $(NEWEST),$(PIP) install --quiet --upgrade $(NEWEST))
	@touch $@

# After a change of constraints.txt or pyproject.toml: the hashes of all files of each version, for each Python and computer.
LOCK = env -u PIP_FIND_LINKS $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header \
    --no-annotate --default-index https://pypi.org/simple -c constraints.txt pyproject.toml locks/build.in

lock: $(VENV)/.created
	@$(PIP) install --quiet -c constraints.txt uv
	@$(LOCK) --extra plot --extra web --extra physics -o locks/demo.txt
	@$(LOCK) --extra plot --extra export --extra web --extra dev -o locks/dev.txt

demo: $(VENV)/.demo
	@$(BIN)/bioscara demo
	@echo "to see it move in the browser: $(BIN)/bioscara demo --watch"

# PyPI has ROS 2 for these alone; elsewhere its tests are skipped, and say so.
WITH_ROS2 := $(shell $(PYTHON) -c 'import platform, sys; print(int(sys.platform == "linux" and platform.machine() == "x86_64" and (3, 11) <= sys.version_info[:2] < (3, 14)))' 2>/dev/null)

# "auto" counts the cores without their threads, unless psutil is there.
CORES := $(shell $(PYTHON) -c 'import os; print(os.cpu_count() or 1)' 2>/dev/null)
PYTEST := $(BIN)/python -m pytest -n $(CORES) \
    --dist worksteal --ignore-glob='$(EMULATED)' $(if $(CI),--durations=25)

# The tests that failed are named once more at the end, below the output of the runs after theirs.
COLLECT_FAILED := export BIOSCARA_FAILED=$${BIOSCARA_FAILED:-$$(mktemp)};

# A third of the time of the first tests is waiting, for which there is one worker more than cores.
# The browser is apart from them: its library keeps an event loop running in their process.
test: $(VENV)/.dev
	@status=0; $(COLLECT_FAILED) \
	$(PYTEST) -n $$(($(CORES) + 1)) -m 'not (realtime or ros or browser or thorough)' || status=1; \
	$(PYTEST) -m 'realtime or path' tests || status=1; \
	$(MAKE) --no-print-directory page-tests || status=1; \
	cat $$BIOSCARA_FAILED; exit $$status

test-all: $(VENV)/.dev $(if $(filter 1,$(WITH_ROS2)),$(ROS2)/.launch)
	@status=0; $(COLLECT_FAILED) \
	$(MAKE) --no-print-directory test || status=1; \
	$(PYTEST) -m 'thorough and not realtime' tests || status=1; \
	$(PYTEST) -m '(ros or browser) and not path' tests || status=1; \
	$(if $(filter 1,$(WITH_ROS2)),$(MAKE) --no-print-directory ros-tests-312 || status=1;) \
	$(MAKE) --no-print-directory firmware-check || status=1; \
	$(MAKE) --no-print-directory release-check || status=1; \
	$(MAKE) --no-print-directory arm-check || status=1; \
	cat $$BIOSCARA_FAILED; exit $$status

# Python 3.12 is that of the system with ROS 2 jazzy and kilted. Its environment is apart from that of $(PYTHON).
ROS_TESTS_312 ?= tests/ros
ros-tests-312: $(VENV)/.dev
	@python=$$($(BIN)/python -c 'from tools.release_check import python_of; print(python_of("3.12") or "")') || exit 1; \
	if [ -n "$$python" ]; then \
	  $(MAKE) --no-print-directory PYTHON="$$python" ROS2=$(ROS2)-3.12 $(ROS2)-3.12/.launch && \
	  BIOSCARA_ROS2=$(ROS2)-3.12 $(PYTEST) -m ros $(ROS_TESTS_312); \
	else echo "not run, as this computer does not have it: the tests with ROS 2 and Python 3.12: apt install python3.12-venv"; fi

# Of the functions of the page that compute and touch nothing else.
page-tests:
	@if command -v node >/dev/null; then node --test tests/page/*.test.mjs; \
	elif [ -n "$$CI" ]; then echo "no node, which the tests of the page need" >&2; exit 1; \
	else echo "not run, as this computer does not have it: the tests of the page's functions: apt install nodejs"; fi

check: lint types layers fresh

# The page, its tests and its tools: the form by dprint, suspicious code by biome.
OF_PAGE := tools/dashboard/node_modules/.bin
SCRIPTS := -c tools/dashboard/dprint.json 'src/bioscara/dashboard/page/js/**/*.js' 'tests/page/*.mjs' 'tools/dashboard/*.*js'

lint: $(VENV)/.dev tools/dashboard/node_modules/.installed
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(OF_PAGE)/dprint check $(SCRIPTS)
	@$(OF_PAGE)/biome lint --config-path=tools/dashboard/biome.json --error-on-warnings \
	    src/bioscara/dashboard/page/js tests/page tools/dashboard/bundle.mjs
	@$(BIN)/python tools/prose.py

format: $(VENV)/.dev tools/dashboard/node_modules/.installed
	@$(BIN)/ruff format .
	@$(OF_PAGE)/dprint fmt $(SCRIPTS)

types: $(VENV)/.dev tools/dashboard/node_modules/.installed
	@$(BIN)/mypy
	@$(OF_PAGE)/tsc -p tools/dashboard

tools/dashboard/node_modules/.installed: tools/dashboard/package.json tools/dashboard/package-lock.json
	@command -v npm >/dev/null || { echo "no npm, which the checks of the dashboard need: on Debian and Ubuntu, apt install npm" >&2; exit 1; }
	@cd tools/dashboard && npm ci --ignore-scripts --no-audit --no-fund --silent
	@touch $@

layers: $(VENV)/.dev
	@$(BIN)/lint-imports

fresh: $(VENV)/.dev tools/dashboard/node_modules/.installed
	@$(BIN)/python -m bioscara.protocol.generate --check .
	@$(BIN)/python -m tools.existing_arms --check
	@$(BIN)/python -m tools.description --check
	@$(BIN)/python -m tools.ros_packages --check
	@$(BIN)/python -m tools.api_reference --check
	@$(BIN)/python -m tools.world_schema --check
	@$(BIN)/python -m tools.message_types --check
	@$(BIN)/python -m tools.step_kinds --check
	@node tools/dashboard/bundle.mjs --check

generate: $(VENV)/.dev
	@$(BIN)/python -m bioscara.protocol.generate .
	@$(BIN)/python -m tools.existing_arms
	@$(BIN)/python -m tools.description
	@$(BIN)/python -m tools.ros_packages
	@$(BIN)/python -m tools.api_reference
	@$(BIN)/python -m tools.world_schema
	@$(BIN)/python -m tools.message_types
	@$(BIN)/python -m tools.step_kinds

firmware:
	@$(MAKE) --no-print-directory -C firmware/joint

firmware-check: firmware $(VENV)/.dev
	@firmware/tests/run.sh
	@$(BIN)/python -m pytest -q -n auto --dist worksteal $(EMULATED)

$(VENV)/.release: $(VENV)/.dev
	@$(PIP) install --quiet -c constraints.txt build twine check-wheel-contents abi3audit
	@touch $@

dist: $(VENV)/.release firmware
	@$(BIN)/python -m tools.release dist

release-check: $(VENV)/.release firmware
	@$(BIN)/python -m tools.release_check

arm-check: $(VENV)/.release firmware
	@$(BIN)/python -m tools.arm_check

bench: $(VENV)/.dev
	@$(BIN)/python -m benchmarks

$(VENV)/.docs: $(VENV)/.created pyproject.toml constraints.txt
	@echo "installing the tools for the documentation"
	@$(PIP) install --quiet -c constraints.txt -e '.[docs]'
	@touch $@

docs: $(VENV)/.docs
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet
	@echo "wrote site/index.html"

# Apart from the others: the ROS wheels start each Python of their environment twice. NumPy is that of
# ROS 2 jazzy and kilted, so that the tests run with the oldest series that is supported, too.
INTERFACES := $(shell find interfaces -type f -not -path '*/__pycache__/*')
ROS2_PIP := env -u LD_LIBRARY_PATH -u _ROS_WHEELS_BOOTSTRAP_COMPLETE $(ROS2)/bin/python -m pip --disable-pip-version-check

$(ROS2)/.ros2: $(INTERFACES) pyproject.toml constraints.txt
	@command -v g++ >/dev/null || { echo "no C++ compiler: on Debian and Ubuntu, apt install g++" >&2; exit 1; }
	@$(PYTHON) -m venv $(ROS2)
	@echo "installing ROS 2"
	@(grep -v '^numpy==' constraints.txt; echo "numpy==1.26.4; python_version < '3.13'") >$(ROS2)/constraints.txt
	@$(ROS2_PIP) install --quiet -c $(ROS2)/constraints.txt hatchling -e '.[ros2]'
	@echo "building the interface packages"
	@$(ROS2_PIP) install --quiet --no-deps --no-build-isolation ./interfaces
	@echo "building the firmware for the simulated arm"
	@$(ROS2_PIP) install --quiet -c $(ROS2)/constraints.txt ./firmware
	@touch $@

ros2: $(ROS2)/.ros2

# No registry has launch, ros2 and the spawner of ROS 2. The tests use those of an installed ROS, or of wheels
# in this folder.
ROS2_WHEELS ?= ../shared/judges/ros
OF_LAUNCH := $(wildcard $(ROS2_WHEELS)/*.whl)
.PHONY: $(if $(OF_LAUNCH),$(if $(wildcard $(ROS2)/bin/ros2),,$(ROS2)/.launch))

$(ROS2)/.launch: $(ROS2)/.ros2 $(OF_LAUNCH)
	@$(if $(OF_LAUNCH),$(ROS2_PIP) install --quiet -c $(ROS2)/constraints.txt osrf-pycommon lark argcomplete packaging \
	    importlib-metadata catkin_pkg xacro filelock psutil 'setuptools<70')
	@$(if $(OF_LAUNCH),$(ROS2_PIP) install --quiet --no-deps $(OF_LAUNCH))
	@touch $@

OFTEN := BIOSCARA_EXAMPLES=1000 BIOSCARA_VALUES_SHARE=1 BIOSCARA_EVERY_BIT=1 BIOSCARA_EVERY_JOINT=1 \
    BIOSCARA_LATENCY_STEPS=3000 BIOSCARA_SWITCHES=100000 BIOSCARA_RANDOM_MOVES=10000 \
    BIOSCARA_OWN_MOVES=10000 BIOSCARA_HOMING_STARTS=1000 BIOSCARA_FAULT_SEEDS=200 BIOSCARA_FUZZ_SEEDS=200 \
    BIOSCARA_LOAD_SEEDS=200 BIOSCARA_INTERLEAVINGS=1000
LAWS := tests/control/manager/test_manager_at_speed.py tests/planning/collision/test_zones.py \
    tests/planning/motions/test_jog.py tests/planning/collision/test_stop_guard.py \
    tests/planning/collision/test_bodies.py tests/control/limits/test_clearance.py \
    tests/control/controllers/joint_trajectory/test_pausing.py \
    tests/control/controllers/joint_trajectory/test_invariants.py tests/planning/motions/test_cartesian.py \
    tests/planning/collision/test_broad_phase.py tests/planning/paths/test_blending.py \
    tests/robot/test_planner_beside_itself.py tests/model/test_parameters.py \
    tests/drivers/test_unusable_values.py tests/remote/test_unusable_values.py \
    tests/robot/test_unusable_values.py tests/system/test_random_faults.py tests/system/test_load_speed.py \
    tests/robot/test_robot_fuzz.py tests/drivers/link/test_handshake.py tests/sim/test_socket_bus.py \
    tests/server/test_interleavings.py tests/oracle tests/firmware

laws: $(VENV)/.dev firmware
	@status=0; \
	$(OFTEN) $(BIN)/python -m pytest -o timeout=0 -n auto --dist worksteal -m 'not realtime' $(LAWS) || status=1; \
	$(OFTEN) $(BIN)/python -m pytest -o timeout=0 -m realtime $(LAWS) || status=1; \
	exit $$status

soak: $(VENV)/.dev
	@$(BIN)/python -m tests.soak

page-soak: $(VENV)/.dev
	@PYTHONPATH=tests $(BIN)/python -m dashboard.soak

mutants: $(VENV)/.dev
	@$(BIN)/python tests/mutants.py

# All that .gitignore has, except what an arm has written: runs and faults.
BUILT := __pycache__ *.egg-info node_modules .cache .*_cache .hypothesis build dist
clean:
	@rm -rf '$(VENV)' '$(ROS2)' '$(ROS2)-3.12' site
	@find . \( -name .git -o -name '.venv*' \) -prune -o \( -path ./runs -o -path ./faults \) -prune -o -type f -name '*.so' -exec rm {} + \
	    -o -type d \( $(patsubst %,-name '%' -o,$(BUILT)) -false \) -prune -exec rm -rf {} +
