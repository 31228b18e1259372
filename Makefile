# `make demo` and `make test` are all that a new user needs; both install what is missing and build once.

CARGO ?= cargo
# One profile for tests and runs, so a fresh machine compiles burn only once.
RELEASE := --release
# The rules below name programs in target, so everything is built there. A script that needs another folder sets it by itself.
override export CARGO_TARGET_DIR := $(CURDIR)/target

.DEFAULT_GOAL := help
.PHONY: help setup build demo web site test-site test-guides edge wheel capi test-python test-c test test-compile test-browser test-web film walk acceptance test-v4l test-peers test-ros2 test-slurm slurm-image deb tarball image windows test-arm64 release hardening network-grasps placing heights test-wgpu test-ndarray test-torch package lint base-weights bench bench-search bench-browser bench-planning clean deny endure coverage

help: ## Lists the targets
	@sed -n 's/^\([a-z0-9-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 18

setup: ## Installs what is missing from Debian (sudo only when not root)
	@scripts/setup.sh

build: setup ## Builds target/release/sdg
	@scripts/build.sh --bin sdg

demo: build ## Teaches the pendulum from one photo, grasps it ten times, writes report/index.html
	target/release/sdg demo

web: setup ## Builds the page that detects in the browser into target/web (CARD=no: without the module for graphics cards)
	@CARD="$(CARD)" scripts/web.sh

site: setup web ## Builds the site of all guides into target/site (mdBook from its registry, once)
	@scripts/site.sh

# Screenshots stay in target/site-test.
test-site: site ## Checks the built site: links, anchors, nothing from elsewhere, size, axe-core at widths of 390 and 1280 px
	@scripts/install.sh chromium chromium-driver
	@scripts/axe.sh
	$(CARGO) test $(RELEASE) --locked --workspace --test checks -- --ignored site::

test-guides: setup ## Runs the guides' commands, those that take long too
	$(CARGO) test $(RELEASE) --locked --workspace --test cli -- --ignored --nocapture guides::

edge: setup ## Builds sdg without simulator for small machines, target/edge/sdg, and measures it
	@scripts/edge.sh $(EDGE)

wheel: setup ## Builds the Python package's wheel into target/wheels (maturin from PyPI; MANYLINUX=1: one that runs from glibc 2.31 on, in target/packages/wheel, also with ARCH=arm64; TRY=1, as root: then used in Debian 11)
	@$(if $(MANYLINUX),ARCH="$(ARCH)" TRY="$(TRY)" scripts/packages/wheel.sh,scripts/python/wheel.sh)

test-python: wheel ## Tests the wheel in a clean environment: the same grasps as Rust's, wrong input, the guide (PYTEST="-k equal": some)
	@scripts/python/test.sh $(PYTEST)

capi: setup ## Builds the C library into target/capi: lib, include, pkg-config's and CMake's files (TRY=1, as root: then used in a clean Debian)
	@scripts/c/install.sh target/capi
	@$(if $(TRY),scripts/c/try.sh target/capi)

test-c: wheel capi ## Tests the C library: programs in C and C++ under valgrind, the same grasps as Rust's, wrong input, the guide (PYTEST="-k equal": some)
	@scripts/c/test.sh $(PYTEST)

# Without the examples, which cargo would compile too; `make lint` checks them.
TESTS_ALONE = --lib --bins --tests

test-compile: setup ## Compiles every test
	@if $(CARGO) nextest --version >/dev/null 2>&1; then \
		$(CARGO) nextest run $(RELEASE) --locked --workspace $(TESTS_ALONE) --no-run; \
	else \
		$(CARGO) test $(RELEASE) --locked --workspace $(TESTS_ALONE) --no-run; \
	fi

# Uses nextest if it is installed, otherwise cargo's own runner. nextest does not run the examples in the docs.
test: setup ## Runs the tests, except those with targets of their own
	@if $(CARGO) nextest --version >/dev/null 2>&1; then \
		$(CARGO) nextest run $(RELEASE) --locked --workspace $(TESTS_ALONE); \
	else \
		$(CARGO) test $(RELEASE) --locked --workspace $(TESTS_ALONE); \
	fi
	@$(CARGO) test $(RELEASE) --locked --workspace --doc -q

# Tests marked as needing Chromium; screenshots stay in target/browser-test.
test-browser: build ## Tests the program's pages in headless Chromium
	@scripts/install.sh chromium chromium-driver
	@scripts/axe.sh
	$(CARGO) test $(RELEASE) --locked --workspace --test cli -- --ignored --test-threads 1 browser:: --skip film::

test-web: build web ## Tests the page that detects in the browser, in headless Chromium
	@scripts/install.sh chromium chromium-driver
	$(CARGO) test $(RELEASE) --locked --workspace --test browser -- --ignored --test-threads 1 $(if $(filter no,$(CARD)),--skip graphics_card)

film: build ## Makes the pictures of the front page, the tour and the gallery, datasets/pictures
	@scripts/install.sh chromium chromium-driver
	$(CARGO) test $(RELEASE) --locked --workspace --test cli -- --ignored film:: gallery::

# A folder has demo.* and further pictures with LabelMe marks beside them; FOLDER=2 if the part looks the same after half a turn.
walk: build ## Times the way from a photo to a tried model, through the page in Chromium (SETS="FOLDER …")
	@scripts/install.sh chromium chromium-driver
	@scripts/axe.sh
	SDG_WALK="$(abspath $(SETS))" $(CARGO) test $(RELEASE) --locked --workspace --test cli -- --ignored --nocapture walk::

# A run without TUNED=1 measures the reported side: record it in docs/decisions/025-acceptance.md.
MODELS ?= S
acceptance: build ## Teaches the sets of datasets/split.toml and counts both sides of the split (SETS=FOLDER, MODELS=S,C; TUNED=1: one side)
	target/release/sdg evaluate --split datasets/split.toml --sets "$(or $(SETS),../shared)" --models $(MODELS) $(if $(TUNED),--tuned)

test-v4l: setup ## Tests V4L2 cameras in QEMU: Debian's kernel, vivid, and a USB camera of our own (no root, no camera)
	@scripts/test-v4l.sh

test-peers: setup ## Tests the robot's protocol: libfranka drives our simulated Panda, our client drives franka-sim
	@scripts/test-peers.sh

test-ros2: setup ## Tests ROS 2 against Cyclone DDS and Fast DDS on loopback (burn is compiled once more; TESTS=latency: one of them)
	@scripts/test-ros2.sh

test-slurm: build ## Compares an evaluation as Slurm's job arrays with the serial one: a node dies, the controller is restarted, a unit fails (root)
	@scripts/test-slurm.sh

slurm-image: build ## An OCI image of sdg by mmdebstrap and umoci, run without network where namespaces are allowed (root)
	@scripts/slurm/image.sh

# PROFILE=release takes a quarter of the time, for trials.
deb: setup ## A Debian package of sdg, in target/packages/deb (ARCH=arm64: for arm64; TRY=1, as root: then installed, used and removed in a clean Debian)
	@ARCH="$(ARCH)" TRY="$(TRY)" scripts/packages/deb.sh

tarball: setup ## One directory of sdg that runs from glibc 2.31 on, in target/packages/tarball (ARCH=arm64: for arm64; TRY=1, as root: then used in Debian 11)
	@ARCH="$(ARCH)" TRY="$(TRY)" scripts/packages/tarball.sh

test-arm64: setup ## Unit tests that need no simulator, compiled for arm64, under qemu (burn is compiled once more)
	@scripts/packages/test_arm64.sh

image: setup ## An OCI image for users, in target/packages/image, used without network where namespaces are allowed (root)
	@scripts/packages/image.sh

windows: setup ## sdg.exe without simulator, as a zip in target/packages/windows (TRY=1: used under Wine)
	@TRY="$(TRY)" scripts/packages/windows.sh

release: setup ## All packages with checksums, lists of their contents, and the check of the libraries' interfaces, in target/packages/release
	@scripts/packages/release.sh

hardening: setup ## Hostile input for every reader of files and messages from outside, resumed where the same program ended (EXECUTIONS=1000000, TARGETS="png jpeg"; QUICK=1: two minutes; COVERAGE=1: lines reached; SECTIONS="input sync coverage guards address thread")
	@QUICK="$(QUICK)" SECTIONS="$(or $(SECTIONS),$(if $(COVERAGE),coverage))" EXECUTIONS="$(EXECUTIONS)" TARGETS="$(TARGETS)" SHOW="$(SHOW)" scripts/hardening/run.sh

endure: setup ## Commands killed while the disk loses what was not synced, full disks, long runs, a robot with wrong perception (SECTION="crash soak", QUICK=1; root)
	@scripts/hardening/endure.sh $(SECTION)

coverage: setup ## Lines and regions of robot, fci and kinematics that tests reach (FILES=1: also the lines that no test reaches)
	@scripts/coverage.sh

# burn is compiled once more, with the device's backend; the tests are those that compare devices with flex.
DEVICE_TESTS = $(CARGO) test $(RELEASE) --locked -p sdg-kernels -p sdg-grasp -p sdg-cli --features sdg-cli/$(1)

network-grasps: setup ## Grasps of all parts over TCP and UDP, compared with the same in one process, in lockstep and in real time (NETWORK_GRASPS=5: fewer)
	@scripts/network-grasps.sh

placing: setup ## Places 20 parts in a tray and grasps from a table 5 mm higher than configured, in one process and over TCP and UDP in lockstep
	@scripts/placing.sh

heights: setup ## Grasps with unknown heights, from higher tables and from blocks: how exactly heights are measured, and how many hold (HEIGHTS=2 for fewer)
	@scripts/heights.sh

test-wgpu: setup ## Tests wgpu against flex, on a graphics card or else on Mesa's software Vulkan
	@scripts/install.sh libvulkan1 mesa-vulkan-drivers
	$(call DEVICE_TESTS,wgpu) --test device_parity
	$(call DEVICE_TESTS,wgpu) --test cli -- devices::
	$(call DEVICE_TESTS,wgpu) --lib -- device_parity

test-ndarray: setup ## Tests ndarray against flex (ten minutes to compile, three to run)
	$(call DEVICE_TESTS,ndarray) --test device_parity
	$(call DEVICE_TESTS,ndarray) --test cli -- devices::
	$(call DEVICE_TESTS,ndarray) --lib -- device_parity

# Any Python with torchvision; the default is that of `make bench` (0.9 GB, downloaded once).
SDG_TORCH_PYTHON ?= $(CURDIR)/target/bench/venv/bin/python

test-torch: setup ## Tests a whole network against torchvision, losses and gradients included
	@[ -x "$(SDG_TORCH_PYTHON)" ] || benches/peers/install.sh target/bench/venv
	SDG_TORCH_PYTHON="$(SDG_TORCH_PYTHON)" $(CARGO) test $(RELEASE) --locked --workspace --test detection -- --ignored golden::

# The libraries for other programs, and their dependencies. Nothing is published; nothing is compiled, because the tests compile the same code.
PACKAGED = geometry picture kinematics sift shape grasp kernels layers detection demonstration training orientation comparison part-generator

package: ## Packages the libraries that other programs can use, into target/package
	$(CARGO) package $(foreach crate,$(PACKAGED),-p sdg-$(crate)) --no-verify

# With the features of all crates, so that code that CI does not run is compiled too; then the program for small machines, which has
# no feature. Unless DOCS_RS is set, CUDA's build downloads LLVM, which a check does not need.
FEATURES = sdg-cli/ndarray,sdg-cli/wgpu,sdg-cli/cuda,sdg-cli/ros2,sdg-base-weights/wgpu,sdg-base-weights/cuda,sdg-web/webgpu,sdg-python/extension

lint: setup ## Spelling, formatting and lints with every feature; warnings are errors, as in CI
	@scripts/spelling.sh
	$(CARGO) fmt --all --check
	DOCS_RS=1 $(CARGO) clippy $(RELEASE) --locked --workspace --all-targets --features $(FEATURES) -- -D warnings
	$(CARGO) clippy $(RELEASE) --locked --package sdg-cli --no-default-features --all-targets -- -D warnings

deny: setup ## Licences and sources of all dependencies, and advisories where their database can be reached (ADVISORIES=FOLDER: a clone of it)
	@ADVISORIES="$(ADVISORIES)" scripts/deny.sh

# Checkpoints in target/base-weights are continued. DEVICE: flex, wgpu or cuda.
DEVICE ?= flex
BASE_WEIGHTS := target/base-weights
base-weights: setup ## Pretrains preset edge on generated parts (hours; continues where it was stopped)
	$(CARGO) build $(RELEASE) --locked --workspace --bin sdg-base-weights --features sdg-base-weights/$(DEVICE)
	mkdir -p $(BASE_WEIGHTS)
	target/release/sdg-base-weights pretrain --checkpoint $(BASE_WEIGHTS)/detector.safetensors --device $(DEVICE)
	target/release/sdg-base-weights pretrain --network orientation --steps 3000 \
		--checkpoint $(BASE_WEIGHTS)/orientation.safetensors --device $(DEVICE)
	target/release/sdg-base-weights export --detector $(BASE_WEIGHTS)/detector.safetensors \
		--orientation $(BASE_WEIGHTS)/orientation.safetensors --out $(BASE_WEIGHTS)/networks.safetensors \
		--commit $$(git rev-parse --short HEAD)
	target/release/sdg-base-weights pretrain --network comparison --steps 5000 --trunk $(BASE_WEIGHTS)/networks.safetensors \
		--checkpoint $(BASE_WEIGHTS)/comparison.safetensors --device $(DEVICE)
	target/release/sdg-base-weights export --base $(BASE_WEIGHTS)/networks.safetensors \
		--comparison $(BASE_WEIGHTS)/comparison.safetensors --out $(BASE_WEIGHTS)/edge.safetensors \
		--commit $$(git rev-parse --short HEAD)

bench: setup ## Our speed against PyTorch, ONNX Runtime, OpenVINO, albumentations (BENCH=--quick: sooner), and bench-search
	@scripts/build.sh --bin sdg --bin sdg-bench
	benches/peers/install.sh target/bench/venv
	target/release/sdg-bench compare --results benches/RESULTS.md $(BENCH)
	@$(MAKE) bench-search QUICK=$(findstring --quick,$(BENCH))

# Without a folder of sets, only shipped parts are measured. Only the sets to which constants are or were fitted are opened.
bench-search: setup ## Model S against corrmatch, OpenCV's matchTemplate and LINEMOD, and its curves of time (SETS=FOLDER; QUICK=1: shipped parts, nothing is written)
	@scripts/build.sh --bin sdg-bench
	benches/peers/install-matchers.sh target/bench/matchers
	target/release/sdg-bench matchers $(if $(QUICK),--rounds 1,--sets "$(or $(SETS),../shared)" --results benches/RESULTS.md)
	target/release/sdg-bench curves $(if $(QUICK),--secs 0.2,--results benches/RESULTS.md)

# Uses the model that `make bench` writes, or else teaches one; npm downloads onnxruntime-web.
bench-browser: web ## The page's speed against onnxruntime-web in headless Chromium
	@scripts/build.sh --bin sdg --bin sdg-bench
	benches/peers/install.sh target/bench/venv
	benches/browser/install.sh target/bench/onnxruntime-web
	[ -f target/bench/pendulum.sdg ] || target/release/sdg teach --seed 1 --demo datasets/demonstrations/pendulum/image.png:datasets/demonstrations/pendulum/annotation.json --out target/bench/pendulum.sdg
	target/release/sdg-bench browser --results benches/RESULTS.md $(BENCH)

# Installs PyPI's ompl in target/plan-peers. Takes a quarter of an hour on two cores.
bench-planning: setup ## Planning: a thousand random problems followed in MuJoCo, checks per second, and OMPL on the same model
	$(CARGO) build $(RELEASE) --locked --workspace --example planning
	target/release/examples/planning rate
	target/release/examples/planning proof 1000
	scripts/python/venv.sh target/plan-peers ompl
	target/plan-peers/bin/python benches/peers/ompl_planning.py target/release/examples/planning 300 0 0.005

clean: ## Removes what was built and reported
	$(CARGO) clean
	rm -rf report
