# Every target creates its own environment; python3 (3.10 or newer) and the package registry are all it needs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
BENCH := .venv-bench

# The tests start a few hundred interpreters, and half the time of a start is compiling the modules.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help test lint docs wheel test-package test-lowest test-slow test-search test-browser reproduce comparison bench constraints clean

help:
	@echo "make reproduce   the two experiments of the paper: tables and figures in results/"
	@echo "make test        lint, types, import rules, the documents and the default test suite"
	@echo "make docs        the documents as a site in results/site, warnings are errors"
	@echo "make wheel       the source distribution and the wheel, with compiled kernels in it"
	@echo "make test-package the default suite on the wheel, from the source distribution"
	@echo "make test-lowest the default suite on the lowest versions that are allowed (PYTHON=python3.10)"
	@echo "make test-slow   campaigns that take minutes, and pairs that the default suite leaves out"
	@echo "make test-search the default suite with examples drawn anew, and twenty times as many of the laws"
	@echo "make test-browser the viewer in headless Chromium, which must be installed"
	@echo "make comparison  run other methods on the show-piece; rewrites the tables in the documents"
	@echo "make bench       time the tick beside other controllers, in an environment of its own"
	@echo "make constraints pin the versions that the tests cover"
	@echo "make clean       remove the environment and everything that was made"

$(INSTALLED): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	$(BIN)/uv pip install --quiet --python $(BIN)/python --constraints constraints.txt --editable '.[all,docs,test]'
	@touch $@

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright
	$(BIN)/lint-imports --no-cache

docs: $(INSTALLED)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "results: results/site/index.html"

# Checks that use one core each run side by side.
test: $(INSTALLED)
	+$(MAKE) -j 2 lint docs
	$(BIN)/python -m pytest -n 2

# The wheel is made from the source distribution, its kernels by the compiler that the tests cover.
wheel: $(INSTALLED)
	rm -rf results/package
	UV_CONSTRAINT=$(CURDIR)/constraints.txt $(BIN)/python -m build --installer uv --outdir results/package .

# What is shipped is what is tested: the wheel, in an environment of its own, by the tests that the
# source distribution carries. Its kernels are compiled already: whoever starts one needs no compiler.
PACKAGE := .venv-package
test-package: wheel
	rm -rf $(PACKAGE)
	$(PYTHON) -m venv $(PACKAGE)
	$(BIN)/uv pip install --quiet --python $(PACKAGE)/bin/python --constraints constraints.txt "opspace[all,docs,test] @ $$(ls results/package/*.whl)"
	tar -xzf results/package/*.tar.gz -C results/package
	cd results/package/opspace-*/ && $(CURDIR)/$(PACKAGE)/bin/python -c "import opspace; assert 'site-packages' in opspace.__file__, opspace.__file__"
	cd results/package/opspace-*/ && $(CURDIR)/$(PACKAGE)/bin/python -c "from opspace.plan.entries import KERNELS; KERNELS.load(); assert KERNELS.came == 'shipped', KERNELS.came"
	cd results/package/opspace-*/ && $(CURDIR)/$(PACKAGE)/bin/python -m pytest -n 2

# Every floor that pyproject.toml declares, at once, with the test tools of today. The wheels of
# Pinocchio 3 do not say which version of these two libraries they were built for. Old versions warn
# of what has gone from the new ones: here a warning is no error.
LOWEST := .venv-lowest
test-lowest: $(INSTALLED)
	rm -rf $(LOWEST)
	$(PYTHON) -m venv $(LOWEST)
	printf 'cmeel-urdfdom<5\ncmeel-tinyxml2<11\n' > $(LOWEST)/built-for.txt
	$(BIN)/uv pip compile --quiet --python $(LOWEST)/bin/python --resolution lowest-direct --only-binary :all: --constraints $(LOWEST)/built-for.txt --extra all --no-header --no-annotate --output-file $(LOWEST)/lowest.txt pyproject.toml
	$(BIN)/uv pip install --quiet --python $(LOWEST)/bin/python --constraints $(LOWEST)/lowest.txt --editable '.[all,docs,test]'
	NUMBA_CACHE_DIR=$(CURDIR)/$(LOWEST)/kept $(LOWEST)/bin/python -m pytest -n 2 -W default -W ignore::DeprecationWarning

test-slow: $(INSTALLED)
	$(BIN)/python -m pytest -m slow

test-search: $(INSTALLED)
	OPSPACE_CAMPAIGN=1 $(BIN)/python -m pytest -n 2 --hypothesis-profile=search

test-browser: $(INSTALLED)
	$(BIN)/python -m pytest -m browser

reproduce: $(INSTALLED)
	$(BIN)/opspace reproduce all --out results

comparison: $(INSTALLED)
	$(BIN)/python docs/evidence/comparison.py

# The peers fix older versions of the dynamics library than the tests cover.
$(BENCH)/.installed: pyproject.toml $(INSTALLED)
	$(PYTHON) -m venv $(BENCH)
	$(BIN)/uv pip install --quiet --python $(BENCH)/bin/python --editable '.[all,bench]'
	@touch $@

bench: $(BENCH)/.installed
	$(BENCH)/bin/opspace bench --core 0 --out results/bench

constraints: $(INSTALLED)
	$(BIN)/uv pip compile --quiet --universal --upgrade --python-version 3.10 --extra all --extra docs --extra test --no-header --no-annotate --no-emit-index-url --output-file constraints.txt pyproject.toml

clean:
	rm -rf $(VENV) $(BENCH) $(PACKAGE) $(LOWEST) results dist build .pytest_cache .ruff_cache .hypothesis
