# Every target makes its own .venv and installs what it needs: Rust, Python and make are enough.
.DEFAULT_GOAL := help
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
ifeq ($(OS),Windows_NT)
BIN := $(VENV)/Scripts
endif
PIP := $(BIN)/python -m pip install -q --disable-pip-version-check
SOURCES := Cargo.toml Cargo.lock pyproject.toml rust/bindings/Cargo.toml $(shell find rust/src rust/bindings/src -name '*.rs')

.PHONY: help demo test test-rust test-python lint bench bench-rust bench-python docs soak clean

help: ## what there is to make
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/'

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)
	$(PIP) --upgrade pip

# The package itself, in release, editable: rebuilt when a Rust source or a manifest changes.
$(VENV)/built: $(BIN)/python $(SOURCES)
	$(PIP) 'maturin>=1.16,<2'
	$(BIN)/maturin develop --release --locked --extras plot,html
	@touch $@

$(VENV)/group-%: $(BIN)/python pyproject.toml
	$(PIP) 'pip>=25.1'
	$(PIP) --group $*
	@touch $@

demo: $(VENV)/built ## mill a helix with the free spin optimised; tables, trajectories and pictures in out/
	$(BIN)/redundancy solve examples/helix_milling.toml --out out

test: test-rust test-python ## every test

test-rust: ## the core without Python, then documentation
	cargo test --locked

test-python: $(VENV)/built $(VENV)/group-test ## the package
	$(BIN)/python -m pytest -q

lint: $(VENV)/built $(VENV)/group-lint $(VENV)/group-test ## formatters, linters, types, stubs
	cargo fmt --check
	cargo clippy --locked --workspace --all-targets -- -D warnings
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest redundancy._core --mypy-config-file pyproject.toml
	$(BIN)/python -m evidence.machine_code

bench: bench-rust bench-python ## kernels by criterion, Python calls beside peers

bench-rust:
	cargo bench --locked

bench-python: $(VENV)/built $(VENV)/group-bench
	$(BIN)/python -m pytest benches/python -q --benchmark-columns=median,iqr,min --benchmark-sort=name -p no:cacheprovider -W default

docs: $(VENV)/built $(VENV)/group-docs ## pages in site/, figures made afresh
	$(BIN)/python -m evidence.figures
	$(BIN)/python -m evidence.planner.figures
	$(BIN)/mkdocs build --strict

soak: $(VENV)/built $(VENV)/group-test $(VENV)/group-qp ## a million bit patterns and poses, a hundred thousand programmes, two thousand plans, projectors, rest, a dozen references by differences
	cargo test --locked --release -- --ignored
	$(BIN)/python -m tests.soak

clean: ## everything made
	rm -rf $(VENV) out site target
