# make demo and make test need nothing but Python, make and the network: the environment is made on first use.

# Python that makes the environment, 3.11 or newer.
PYTHON ?= python3
# Environment that everything runs in.
VENV ?= .venv
# Further options of pip, such as an index of CPU-only builds of PyTorch.
PIP_FLAGS ?=

BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
INSTALLED := build/installed

.PHONY: help venv demo test coverage fuzz check style types imports bench clean $(INSTALLED)

help:
	@echo "make demo    carry and open a shipped box with simulated hands, from nothing"
	@echo "make test    run the tests"
	@echo "make coverage  run the tests, and list the lines and branches that none of them takes"
	@echo "make fuzz    damage files of every kind by the thousand, and count how it ended"
	@echo "make check   run linter, formatter, type checker and import contracts"
	@echo "make bench   measure throughput"
	@echo "make venv    make the environment in $(VENV)"
	@echo "make clean   remove what tools left behind, but no environment and no runs"

venv: $(STAMP)

# The stamp is written last, so that an interrupted installation is taken up again.
$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "artigrasp needs Python 3.11 or newer: make PYTHON=...")'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@echo "Installing into $(VENV): this takes a few minutes once."
	$(BIN)/python -m pip install --quiet --disable-pip-version-check $(PIP_FLAGS) -c constraints.txt -e ".[dev]"
	@touch $@

demo: $(STAMP)
	$(BIN)/artigrasp demo

test: $(STAMP)
	$(BIN)/python -m pytest

coverage: $(STAMP)
	$(BIN)/python -m coverage run -m pytest
	$(BIN)/python -m coverage report

bench: $(STAMP)
	$(BIN)/artigrasp bench

# Some twenty minutes.
fuzz: $(STAMP)
	$(BIN)/python -m tools.fuzz_readers
	ARTIGRASP_FUZZ=10 $(BIN)/python -m pytest -q --hypothesis-show-statistics -k damaged tests

check: style types imports

style: $(STAMP)
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: $(INSTALLED)
	cd $(INSTALLED) && $(CURDIR)/$(BIN)/mypy --config-file $(CURDIR)/pyproject.toml --cache-dir $(CURDIR)/.mypy_cache -p artigrasp -p tools

imports: $(INSTALLED)
	cd $(INSTALLED) && PYTHONPATH=. $(CURDIR)/$(BIN)/lint-imports --config $(CURDIR)/pyproject.toml --no-cache --no-logo

# Types and imports are checked on a real installation: only there are kernels, tasks and assets_usd inside the package.
# The tools beside it are those of the checkout.
$(INSTALLED): $(STAMP)
	rm -rf build
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --target $@ .
	ln -s $(CURDIR)/tools $@/tools

clean:
	rm -rf build dist *.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis .coverage*
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
