# `make run` and `make test` set up whatever is missing, then do their work.
VENV ?= .venv
PYTHON := $(VENV)/bin/python
ARGS ?=

.PHONY: run test setup lint clean

run: setup
	$(PYTHON) -m sr_mj.run --scene cluttered15 $(ARGS)

# Two workers of one thread each: threads of several processes would wait for each other's cores.
test: setup
	OMP_NUM_THREADS=1 $(PYTHON) -m pytest -n 2 --dist loadfile $(ARGS)

setup:
	@VENV=$(VENV) bash tools/setup.sh

lint: setup
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/pyright
	$(VENV)/bin/lint-imports

clean:
	rm -rf $(VENV) .pytest_cache .ruff_cache .import_linter_cache
