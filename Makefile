# make demo   set up, then the main job        make check  format, lint, types, import rules, prose, site
# make quick  what every edit wants; make test  what every commit wants; make test-long  all tests
# make soak, make fuzz  for hours
# make bench  measurements beside peers        make fresh  README's commands on a minimal Debian (root)
# make wheel  dist/*.whl, the modem compiled for x86-64 and 64-bit ARM; and the client alone
# make deb    dist/*.deb for the Debian or Ubuntu that it runs on
# make docs   the site, into build/site        make reference, make figures  pages made from the code, pictures
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

# Tests in parallel, those in real time last and alone. `make test TESTS=tests/link` is a part.
TESTS ?= tests
WORKERS ?= auto
PYTEST := $(BIN)/python -m pytest -n $(WORKERS) --maxprocesses 8

.PHONY: setup demo quick test test-long soak fuzz fresh check format wheel deb bench docs reference figures system-packages clean

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt sdrlinkd/__init__.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "sdrlinkd needs Python 3.11 or newer; name one: make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
		{ echo "python3 has no venv module; on Debian: apt-get install python3-venv"; exit 1; }
	$(PIP) -e '.[plots,web]'
	@command -v cc >/dev/null || command -v gcc >/dev/null || command -v clang >/dev/null || $(PIP) ziglang
	@$(BIN)/sdrlinkctl phy compile || echo "the modem will run on NumPy, slowly: install gcc, then sdrlinkctl phy compile"
	@touch $@

$(DEV_STAMP): $(STAMP)
	$(PIP) -e '.[plots,web,dev]'
	@touch $@

demo: setup
	$(BIN)/sdrlinkctl demo

test: $(DEV_STAMP) system-packages
	$(PYTEST) -m "not long" $(TESTS)

quick: $(DEV_STAMP)
	$(PYTEST) -m "not slow and not realtime and not long" $(TESTS)

# Everything, with all the trials of each law and rate.
test-long: $(DEV_STAMP) system-packages
	SDRLINK_TRIALS=1 $(PYTEST) $(TESTS)

# The scorecard, each row for so many seconds; rates with 30 times as many trials; real time ten times.
soak: $(DEV_STAMP)
	$(BIN)/python -m tests.scorecard $(or $(SECONDS),60)
	SDRLINK_TRIALS=30 $(PYTEST) -m soak $(TESTS)
	for i in 1 2 3 4 5 6 7 8 9 10; do $(BIN)/python -m pytest -m realtime $(TESTS) || exit 1; done

# Each reader for so many seconds, by coverage; then laws on input that nobody has seen yet.
fuzz: $(DEV_STAMP)
	$(BIN)/python -m tests.fuzz $(or $(SECONDS),600)
	SDRLINK_TRIALS=300 $(PYTEST) -m hypothesis $(TESTS)

fresh: $(DEV_STAMP)
	sh etc/fresh.sh
	SDRLINK_FRESH=1 $(BIN)/python -m pytest tests/packages

check: $(DEV_STAMP)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m docs.site.prose
	$(MAKE) -s docs

format: $(DEV_STAMP)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# With the modem compiled for each family of processors.
wheel: $(DEV_STAMP)
	rm -rf phy/engine/libraries
	for each in x86-64-v3 x86-64 aarch64; do $(BIN)/sdrlinkctl phy compile --for $$each || exit 1; done
	$(BIN)/python -m hatchling build -t wheel
	cd etc/client && ../../$(BIN)/python -m hatchling build -t wheel -d ../../dist
	rm -rf build/of-wheel && $(BIN)/python -m venv build/of-wheel
	build/of-wheel/bin/python -m pip --quiet --disable-pip-version-check install -c constraints.txt \
		"$$(echo dist/sdrlinkd-*.whl)[plots,metrics,zenoh,web,foxglove]"
	sh etc/sbom.sh build/of-wheel/bin/python dist/sdrlinkd.cdx.json

deb:
	sh etc/deb/build.sh

bench: $(DEV_STAMP)
	$(BIN)/python -m benchmarks

# Strict: a dead link, or an anchor that is not there, ends it.
docs: $(DEV_STAMP)
	$(BIN)/python -m docs.site.stage
	$(BIN)/zensical build --strict -f build/zensical.toml

reference: $(DEV_STAMP)
	$(BIN)/python -m docs.site.reference
	$(BIN)/python -m docs.site.dashboards
	$(BIN)/python -m docs.site.foxglove_layout

# Drawn of what is kept in docs/measured (`python -m benchmarks.NAME --keep`), and of runs in lock-step.
figures: $(DEV_STAMP)
	$(BIN)/python -m benchmarks.page
	$(BIN)/python -m docs.site.figures
	$(BIN)/python -m docs.site.screens

system-packages:
	@sh etc/install-apt-packages.sh

clean:
	rm -rf $(VENV) build .hypothesis .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
