# The two commands: `make demo` runs the main job, `make test` runs the tests.
.PHONY: deps test-deps demo test accuracy test-interop test-slurm wheel test-wheel lint book fuzz deny sbom

CMAKE_VERSION = 3.31.6
ZIGLANG_VERSION = 0.17.1
MDBOOK_VERSION = 0.5.4
CARGO_FUZZ_VERSION = 0.13.2
CARGO_DENY_VERSION = 0.20.2
CARGO_CYCLONEDX_VERSION = 0.5.9
# how long `make fuzz` runs each target
SECONDS = 60

# What a plain `cargo build --release` needs beside cargo and a C compiler.
deps: .tools/bin/cmake

# The readers that the tests open results with.
test-deps: deps .tools/readers

# Simulates an archive, runs the paper's pipeline on it, writes result and report, prints the modes; the last table has
# them beside the truth.
demo: deps
	cargo build --release --locked
	mkdir -p results
	./target/release/afmid run configs/simulate-demo.toml -o results/simulate-demo.h5
	./target/release/afmid run configs/paper.toml -o results/paper.h5
	./target/release/afmid report results/paper.h5 -o results/paper.html
	./target/release/afmid show results/paper.h5 modes

test: test-deps
	cargo test --workspace --locked

# All tests with their full Monte Carlo tables, where `make test` draws a part: before a release (docs/performance.md).
accuracy: test-deps
	AFMID_ACCURACY=1 cargo test --workspace --locked

# afmid with other programs, which `make test` does without: a real Slurm of two emulated nodes (root; installs
# slurm-wlm and munge with apt where they are missing), Snakemake, a model and a plugin under Octave, a plugin with
# scikit-rf, a result in H5Web (octave, chromium, nodejs and npm with apt where they are missing; H5Web from
# registry.npmjs.org). The first line builds the program as `make test` does.
test-interop: test-slurm test-deps
	tests/interop/octave.sh target/debug/afmid .tools/bin/python
	tests/interop/h5web.sh target/debug/afmid
	tests/interop/report.sh target/debug/afmid
	tests/interop/plugins.sh target/debug/afmid .tools/bin/python

# The part of it that .ci/run calls where Slurm can be had.
test-slurm: deps .tools/snakemake/installed
	cargo test --workspace --locked --test commands --no-run
	tests/cluster/workflow.sh target/debug/afmid .tools/snakemake/bin/snakemake
	tests/cluster/slurm.sh target/debug/afmid .tools/snakemake/bin/snakemake

# Zig compiles HDF5 and links against glibc 2.28, so that the wheel installs on older systems than this one.
ifeq ($(shell uname -s),Linux)
ZIG = .tools/wheel/zig
PORTABLE = --zig --compatibility manylinux_2_28 --target $(shell rustc -vV | sed -n 's/^host: //p')
endif

# The Python package as a wheel with HDF5 inside, in dist/: for every Python from 3.10 on, on this kind of system.
wheel: deps .tools/wheel/installed $(ZIG)
	PATH="$(CURDIR)/.tools/wheel/bin:$$PATH" .tools/wheel/bin/maturin build --release --locked $(PORTABLE) \
		--manifest-path python/afmid/native/Cargo.toml --out dist

# The same from the artifacts of the tests (no release build), installed into an empty environment without compiler or
# cargo and tested there.
test-wheel: deps .tools/wheel/installed
	rm -rf target/wheels
	.tools/wheel/bin/maturin build --profile dev --features as-tested --locked --manifest-path python/afmid/native/Cargo.toml \
		--out target/wheels
	tests/wheel/wheel.sh target/wheels/afmid-*.whl python3

lint: deps
	cargo fmt --all --check
	cargo fmt --manifest-path fuzz/Cargo.toml --check
	cargo clippy --workspace --all-targets --locked -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked

# The documentation as a book of pages, in book/.
book: .tools/mdbook/bin/mdbook
	.tools/mdbook/bin/mdbook build

# Not optimised: it has some hundred pages to make, and compiles in half the time.
.tools/mdbook/bin/mdbook:
	CARGO_PROFILE_RELEASE_OPT_LEVEL=0 cargo install --quiet --locked --root .tools/mdbook --no-default-features --features search --version $(MDBOOK_VERSION) mdbook

# Every fuzz target for SECONDS s each, from the corpus in fuzz/corpus; prints a table, fails if something is found.
# Needs g++ (docs/reliability.md).
fuzz: deps .tools/cargo-fuzz/bin/cargo-fuzz
	fuzz/run.sh $(SECONDS)

.tools/cargo-fuzz/bin/cargo-fuzz:
	cargo install --quiet --locked --root .tools/cargo-fuzz --version $(CARGO_FUZZ_VERSION) cargo-fuzz

# Licences, duplicates and sources of all that is compiled (deny.toml), and known vulnerabilities where their database
# can be fetched.
deny: .tools/cargo-deny/bin/cargo-deny
	.tools/cargo-deny/bin/cargo-deny --locked check --hide-inclusion-graph licenses bans sources
	@if .tools/cargo-deny/bin/cargo-deny fetch db; then \
	    .tools/cargo-deny/bin/cargo-deny --locked check --disable-fetch advisories; \
	else \
	    echo "NOT CHECKED: known vulnerabilities. Their database (github.com/RustSec/advisory-db) cannot be fetched from here; run \`make deny\` where it can."; \
	fi

.tools/cargo-deny/bin/cargo-deny:
	cargo install --quiet --locked --root .tools/cargo-deny --version $(CARGO_DENY_VERSION) cargo-deny

# What the program is made of, as CycloneDX: results/afmid.cdx.json.
sbom: .tools/cargo-cyclonedx/bin/cargo-cyclonedx
	SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) .tools/cargo-cyclonedx/bin/cargo-cyclonedx cyclonedx --format json --spec-version 1.5 --describe binaries --no-build-deps
	mkdir -p results
	sed 's|file://$(CURDIR)|file:///afmid|g' afmid_bin.cdx.json > results/afmid.cdx.json
	rm afmid_bin.cdx.json
	@echo results/afmid.cdx.json

.tools/cargo-cyclonedx/bin/cargo-cyclonedx:
	cargo install --quiet --locked --root .tools/cargo-cyclonedx --version $(CARGO_CYCLONEDX_VERSION) cargo-cyclonedx

# Two makes at once may both want it: `python3 -m venv` fails where the folder appears while it makes it.
.tools/:
	mkdir -p $@

# HDF5 is built from source and wants CMake >= 3.26; PyPI's is newer than many systems'.
.tools/bin/cmake: | .tools/
	python3 -m venv .tools
	.tools/bin/python -m pip install --quiet --disable-pip-version-check cmake==$(CMAKE_VERSION)

.tools/readers: tests/requirements.txt | .tools/bin/cmake
	.tools/bin/python -m pip install --quiet --disable-pip-version-check -r tests/requirements.txt
	touch .tools/readers

.tools/wheel/installed: tests/wheel/requirements.txt | .tools/
	python3 -m venv .tools/wheel
	.tools/wheel/bin/python -m pip install --quiet --disable-pip-version-check -r tests/wheel/requirements.txt
	touch $@

.tools/wheel/zig: .tools/wheel/installed
	.tools/wheel/bin/python -m pip install --quiet --disable-pip-version-check ziglang==$(ZIGLANG_VERSION)
	touch $@

# Apart from the readers: its dependencies are many.
.tools/snakemake/installed: tests/interop.txt | .tools/
	python3 -m venv .tools/snakemake
	.tools/snakemake/bin/python -m pip install --quiet --disable-pip-version-check -r tests/interop.txt
	touch $@
