# make demo   set up, then the main job        make check  format, lint, types, import rules
# make test   set up, then all tests           make bench  measurements beside peers
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# What runs; and with what tests and checks need besides.
STAMP := $(VENV)/.installed
DEV_STAMP := $(VENV)/.installed-dev
# Bytecode is made when a module is first used: most of a library never is. Containers like to forbid
# it; then every start of a daemon would take a second longer.
unexport PYTHONDONTWRITEBYTECODE
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt

.PHONY: setup demo test check format bench system-packages clean

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt sdrlinkd/__init__.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "sdrlinkd needs Python 3.11 or newer; name one: make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
		{ echo "python3 has no venv module; on Debian: apt-get install python3-venv"; exit 1; }
	$(PIP) -e '.[plots]'
	@$(BIN)/python -m sdrlinkd.cli.compiling
	@touch $@

$(DEV_STAMP): $(STAMP)
	$(PIP) -e '.[plots,dev]'
	@touch $@

demo: setup
	$(BIN)/sdrlinkctl demo

test: $(DEV_STAMP) system-packages
	$(BIN)/python -m pytest

check: $(DEV_STAMP)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(DEV_STAMP)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(DEV_STAMP)
	$(BIN)/python -m benchmarks.bus
	$(BIN)/python -m benchmarks.modem_path
	$(BIN)/python -m benchmarks.phy_per
	$(BIN)/python -m benchmarks.phy_speed
	$(BIN)/python -m benchmarks.access
	$(BIN)/python -m benchmarks.ether
	$(BIN)/python -m benchmarks.radio
	$(BIN)/python -m benchmarks.flowgraphs
	$(BIN)/python -m benchmarks.pound

system-packages:
	@sh etc/install-apt-packages.sh

clean:
	rm -rf $(VENV) build .hypothesis .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
