# Two commands on a machine with only python3 (3.11+, venv) and make:
#   make demo   sets up, simulates the paper's two-hour run, analyzes it, writes the report
#   make test   sets up, checks style, types and layers, runs the tests
# and
#   make docs   sets up, runs every page of the docs, writes the site to docs/_build/html
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
OUT    ?= demo

# If it is set, each of the many processes of the tests compiles every module anew.
unexport PYTHONDONTWRITEBYTECODE

.DELETE_ON_ERROR:
.PHONY: demo test lint check-style test-statistics test-fuzz test-browser benchmark docs package clean

$(VENV)/runtime.stamp: requirements/runtime.txt requirements/build.txt pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/runtime.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/build.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

$(VENV)/dev.stamp: requirements/dev.txt $(VENV)/runtime.stamp
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/dev.txt
	touch $@

$(VENV)/browser.stamp: requirements/browser.txt $(VENV)/dev.stamp
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/browser.txt
	touch $@

$(VENV)/bench.stamp: requirements/bench.txt $(VENV)/dev.stamp
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/bench.txt
	touch $@

$(VENV)/docs.stamp: requirements/docs.txt $(VENV)/dev.stamp
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/docs.txt
	touch $@

demo: $(VENV)/runtime.stamp
	$(BIN)/sagnac demo -o $(OUT)

# Two processes: the tests are single-threaded for most of their time. Each takes half of the files
# in a row, so that what the tests of a file share is made once.
test: lint
	$(BIN)/python -m pytest -n 2 --dist worksteal
	@command -v chromium >/dev/null && command -v chromedriver >/dev/null || \
	  echo "left out: the page in a browser (make test-browser), since chromium or chromedriver is not installed"

lint: $(VENV)/dev.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The tables are what the tests print.
test-statistics: $(VENV)/dev.stamp
	$(BIN)/python -m pytest -m statistics -n 2 --dist worksteal -v -raP

# Two processes here as well. 200 runs beside busy processes take a quarter of an hour alone.
test-fuzz: $(VENV)/dev.stamp
	timeout 3600 $(BIN)/python -m pytest -m fuzz -n 2 tests/fuzz tests/formats/test_every_run_ends.py tests/core/test_documents.py

# The page, clicked in a Chromium that is installed with its driver; elsewhere it says so.
test-browser: $(VENV)/browser.stamp
	@if command -v chromium >/dev/null && command -v chromedriver >/dev/null; then \
	  $(BIN)/python -m pytest -m browser tests/app; \
	else echo "the tests in a browser are left out: chromium and chromedriver are not installed"; fi

benchmark: $(VENV)/bench.stamp
	$(BIN)/python -m benchmarks

# Pages are executed as they are built, their commands with the `sagnac` of this environment.
docs: $(VENV)/docs.stamp
	$(BIN)/sphinx-build -W --keep-going -q -d docs/_build/doctrees docs docs/_build/html

# Wheel and sdist, checked by their tools, and the command installed from the clone as a user does.
package:
	rm -rf dist .package && $(PYTHON) -m venv .package
	.package/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/package.txt
	.package/bin/python -m build --outdir dist .
	.package/bin/twine check --strict dist/*
	.package/bin/check-wheel-contents dist/*.whl
	PIPX_HOME=$(CURDIR)/.package/pipx PIPX_BIN_DIR=$(CURDIR)/.package/shown .package/bin/pipx install --quiet .
	.package/shown/sagnac --version

clean:
	rm -rf $(VENV) dist .package $(OUT) docs/_build docs/gallery docs/api .pytest_cache .mypy_cache .ruff_cache
