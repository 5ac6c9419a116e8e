# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# Five commands matter, and each works on a fresh Debian 12 machine:
#   make demo     render the bunny; says where the image is
#   make check    build everything and run the tests (check-all: more of them)
#   make bench    run the benchmarks, which takes twenty minutes; says where
#                 the page is (BENCH=--quick: one minute; benchmarks/README.md)
#   make bench-gate BASE=COMMIT   fail where something takes over 5 % longer than
#                 it did at that commit; nine minutes and its build
#   make charts   chart speed against error, which takes a quarter of an hour; says
#                 where the page is (CHARTS=--quick: two minutes)
# On a machine with a card of NVIDIA's, one more:
#   make gpu-bench   compare with cudaraster's and the paper's figures; without a
#                    card, by estimates (GPU_BENCH=--quick; docs/GPU.md)
# And for a machine with a card that has nothing else:
#   make gpu-kit     packs BUILD/gpu-kit.tar.zst, which takes ten minutes
# Code for AArch64, under an emulator, of which `make check` runs a part:
#   make check-aarch64   most of an hour
# All documents and an API reference as a static site, which needs no build:
#   make site     in half a minute; says where the start page is
# For who gives Piko to others:
#   make packages        Debian packages, in a minute
#   make package-check   installs and uses them on a bare Debian 12
# The rest is a thin layer over the presets of CMakePresets.json.

PRESET ?= release
ifeq ($(PRESET),release)
BUILD := build
else
BUILD := build-$(PRESET)
endif
JOBS ?= $(shell nproc)
# Whether sixteen files of a library are compiled as one; see CONTRIBUTING.md.
UNITE ?= ON
# Of the pipelines of examples/raster the fastest.
PIPE ?= Fused

.DELETE_ON_ERROR:
.PHONY: abi all bench bench-gate build charts check check-aarch64 check-all clean configure demo deps \
  docs format gpu-bench gpu-kit lanes lint package-check packages site

all: build

deps:
	@utils/install-deps.sh

configure: deps
	@cmake --preset $(PRESET) -D BUILD_TESTING=ON -D PIKO_ENABLE_GPU=ON \
	  -D PIKO_ENABLE_OPENIMAGEIO=ON -D PIKO_ENABLE_ASSIMP=ON \
	  -D PIKO_ENABLE_PYTHON=ON -D PIKO_UNITE=$(UNITE)

build: configure
	@cmake --build $(BUILD) --parallel $(JOBS)

# Builds no more than it needs: where nothing is configured yet, no tests, no code
# generation for GPUs, no OpenImageIO, no assimp and no Python module, which `make build`
# adds to the same folder.
demo:
	@echo "1 of 4: packages"
	@utils/install-deps.sh utils/packages-demo.txt
	@echo "2 of 4: configuring"
	@[ -e $(BUILD)/build.ninja ] || cmake --preset $(PRESET) \
	  -D BUILD_TESTING=OFF -D PIKO_ENABLE_GPU=OFF \
	  -D PIKO_ENABLE_OPENIMAGEIO=OFF -D PIKO_ENABLE_ASSIMP=OFF \
	  -D PIKO_ENABLE_PYTHON=OFF -D PIKO_UNITE=ON
	@echo "3 of 4: building piko-render"
	@cmake --build $(BUILD) --parallel $(JOBS) --target piko-render
	@echo "4 of 4: rendering the bunny"
	@utils/demo.sh $(BUILD) $(BUILD)/demo $(PIPE)

bench: configure
	@cmake --build $(BUILD) --parallel $(JOBS) \
	  --target piko-render pikoc piko-runtime-benchmark
	@benchmarks/bench.py --bin $(BUILD)/bin --lib $(CURDIR)/$(BUILD)/lib \
	  --out $(BUILD)/bench $(BENCH)

bench-gate: configure
	$(if $(BASE),,$(error expected BASE=COMMIT))
	@cmake --build $(BUILD) --parallel $(JOBS) \
	  --target piko-render pikoc pikort
	@benchmarks/bench-gate.py $(GATE) --bin $(BUILD)/bin --out $(BUILD)/gate $(BASE)

gpu-bench: configure
	@cmake --build $(BUILD) --parallel $(JOBS) \
	  --target piko-render pikoc piko-test-driver
	@benchmarks/gpu-bench.py --bin $(BUILD)/bin \
	  --driver $(BUILD)/lib/libpiko-test-driver.so --out $(BUILD)/gpu-bench \
	  $(GPU_BENCH)

# What proves and times pipelines on a machine that has a card and no LLVM.
gpu-kit: configure
	@cmake --build $(BUILD) --parallel $(JOBS) --target \
	  pikoc piko-compare piko-render piko-render-library PikoConformance-cuda gl-peer
	@utils/gpu-kit/make.py --build $(BUILD) $(GPU_KIT)

# Debian's python3-matplotlib is for its own python3.
charts: configure
	@utils/install-deps.sh utils/packages-charts.txt
	@cmake --build $(BUILD) --parallel $(JOBS) \
	  --target piko-render piko-diff FailureTests
	@/usr/bin/python3 benchmarks/speed-error.py --bin $(BUILD)/bin \
	  --out $(BUILD)/charts $(CHARTS)

# All documents, and Doxygen's reference of the headers; checks all links.
site:
	@utils/install-deps.sh utils/packages-site.txt
	@utils/site/make.py --out $(BUILD)/site

# The Python module for pip, in build/wheel.
.PHONY: wheel
wheel: build
	@/usr/bin/python3 utils/make-wheel.py --build $(BUILD) --out $(BUILD)/wheel

check: build
	@ctest --test-dir $(BUILD) --output-on-failure --parallel $(JOBS)

# What says the same of more, or takes long, too.
check-all: build
	@PIKO_TEST_ALL=1 ctest --test-dir $(BUILD) -C all --output-on-failure \
	  --parallel $(JOBS)

# All that is tested of code for AArch64, under qemu-user.
check-aarch64: build
	@ctest --test-dir $(BUILD) -C aarch64 -R '^aarch64' --output-on-failure \
	  --parallel $(JOBS)

# Formatting, licence headers and paths (also part of `make check`), then
# clang-tidy over the whole project.
lint: build
	@utils/lint.py all
	@utils/lint.py tidy --build $(BUILD)

format:
	@utils/lint.py format --fix

# The table of what lanes are given of each kernel.
lanes: configure
	@cmake --build $(BUILD) --parallel $(JOBS) --target pikoc
	@test/mappings/lanes.py --pikoc $(BUILD)/bin/pikoc --write

# Debian packages, in BUILD/packages; see cmake/PikoPackages.cmake.
packages: build
	@utils/install-deps.sh utils/packages-package.txt
	@rm -f $(BUILD)/packages/*.deb
	@cd $(BUILD) && cpack
	@ls $(CURDIR)/$(BUILD)/packages/*.deb

# Installs them on a bare Debian 12, and does there what their users do; as root.
package-check: packages
	@utils/check-packages.sh $(BUILD)/packages

# What the runtime's library promises, where its version allows.
abi: configure
	@cmake --build $(BUILD) --parallel $(JOBS) --target pikort
	@runtime/test/abi/abi.py --library $(BUILD)/lib/libpikort.so \
	  --include runtime/include --write

docs: deps
	@utils/make-reference.py

clean:
	@rm -rf build build-asan build-debug build-tsan
