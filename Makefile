# The two commands: `make demo` runs the main job, `make test` passes the tests.
.PHONY: deps demo test lint ci

CMAKE_VERSION = 3.31.6

deps: .tools/bin/cmake

# HDF5 is built from source and wants CMake >= 3.26: the system's if it is new enough, PyPI's otherwise.
.tools/bin/cmake:
	python3 -m venv .tools
	.tools/bin/pip install --quiet --disable-pip-version-check cmake==$(CMAKE_VERSION)
