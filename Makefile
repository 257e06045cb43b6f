# Every target does its own set-up: it finds Python >= 3.11, makes .venv and installs the locked dependencies.
# Variables: PYTHON (interpreter to use), HOST and PORT (serve), ARGS (serve, bench, prove), PYTEST_ARGS and PROCESSES
# (test), FUZZ (fuzz: files, api, faces or several), SECONDS_OF_FUZZ (of each) and SEED, SECONDS_OF_SOAK and CLIENTS
# (soak), RECORDINGS (prove: folder of real drives).

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

VENV := .venv
BIN := $(VENV)/bin
LOCK = $(BIN)/uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes --no-header --quiet
PIP := $(BIN)/python -m pip --disable-pip-version-check
HOST ?= 127.0.0.1
PORT ?= 8000
ARGS ?=
PYTEST_ARGS ?=
PROCESSES ?= 2
SECONDS_OF_FUZZ ?= 300
SEED ?= 0
FUZZ ?= files api faces
SECONDS_OF_SOAK ?= 1800
CLIENTS ?= 64
RECORDINGS ?= $(wildcard ../shared/data/recordings/bmw-i3)
BROWSERS := chromium chromium-browser google-chrome
BROWSER_PACKAGES := chromium fonts-dejavu-core
DATABASE_PACKAGES := postgresql
NODE_PACKAGES := nodejs npm
FRONT_ENDS := tests/app/http/faces/clients
CANDIDATES = $(or $(PYTHON),python3 python3.13 python3.12 python3.11 python)

.PHONY: help serve manual test test-jit test-nojit browser node clients postgresql nginx fuzz soak
.PHONY: lint check format bench prove lock clean

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' Makefile

serve: $(VENV)/.runtime $(VENV)/.manual ## Serve the HTTP interface on http://127.0.0.1:8000
	$(BIN)/joulepath serve --host $(HOST) --port $(PORT) $(ARGS)

clients: $(VENV)/.clients ## Bring the front ends into .venv that tests let ask the faces of other engines

manual: $(VENV)/.manual ## Build the manual that the service shows at /manual

test: test-jit test-nojit ## Run all tests in PROCESSES processes, then the small ones again without compilation

# A file's tests stay in one process, so that what its fixtures make is made once. PROCESSES=0: no other, for a debugger.
test-jit: $(VENV)/.dev $(VENV)/.clients $(VENV)/.generators browser postgresql nginx
	$(BIN)/python -m pytest --numprocesses $(PROCESSES) --dist loadfile $(PYTEST_ARGS)

# Takes about 20 s, of which most is collecting, which every process would do for itself.
test-nojit: $(VENV)/.dev
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -m nojit $(PYTEST_ARGS)

fuzz: $(VENV)/.dev ## Give damaged files to readers, odd requests to a service; FUZZ=files, api or faces for one
	@for part in $(FUZZ); do case "$$part" in \
		files) OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.fuzz $(SECONDS_OF_FUZZ) $(SEED);; \
		api) OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.fuzz.api $(SECONDS_OF_FUZZ) $(SEED);; \
		faces) OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.fuzz.faces $(SECONDS_OF_FUZZ) $(SEED);; \
		*) echo "make: FUZZ is $$part, allowed: files, api, faces" >&2; exit 2;; esac; done

soak: $(VENV)/.dev ## Let CLIENTS of all kinds ask a service for SECONDS_OF_SOAK; prints times, memory and what is wrong
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.faults.soak $(SECONDS_OF_SOAK) $(CLIENTS) $(SEED)

browser: ## Install Debian's Chromium for the tests of the web map, where it is missing and root asks
	@if [ -n "$${JOULEPATH_CHROMIUM:-}" ] || command -v $(BROWSERS) >/dev/null; then exit 0; fi; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
		echo "make: installing Chromium for the tests of the web map"; \
		export DEBIAN_FRONTEND=noninteractive; \
		apt-get update -qq && apt-get install -qq -y --no-install-recommends $(BROWSER_PACKAGES) >/dev/null && exit 0; \
	fi; \
	echo "make: there is no Chromium for the tests of the web map. Install it (Debian: apt install $(BROWSER_PACKAGES))" \
		"or name one: JOULEPATH_CHROMIUM=/path/to/chromium" >&2

postgresql: ## Install Debian's PostgreSQL for the tests of the store, where it is missing and root asks
	@if [ -n "$${JOULEPATH_POSTGRESQL_BIN:-}" ] || command -v initdb >/dev/null || \
		compgen -G "/usr/lib/postgresql/*/bin/initdb" >/dev/null; then exit 0; fi; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
		echo "make: installing PostgreSQL for the tests of the store"; \
		export DEBIAN_FRONTEND=noninteractive; \
		apt-get update -qq && apt-get install -qq -y --no-install-recommends $(DATABASE_PACKAGES) >/dev/null && exit 0; \
	fi; \
	echo "make: there is no PostgreSQL for the tests of the store. Install it (Debian: apt install $(DATABASE_PACKAGES))" \
		"or name the folder of its programs: JOULEPATH_POSTGRESQL_BIN=/path/to/bin" >&2

node: ## Install Debian's Node.js for the clients in TypeScript, where it is missing and root asks
	@if command -v node >/dev/null && command -v npm >/dev/null; then exit 0; fi; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
		echo "make: installing Node.js for the tests of clients"; \
		export DEBIAN_FRONTEND=noninteractive; \
		apt-get update -qq && apt-get install -qq -y --no-install-recommends $(NODE_PACKAGES) >/dev/null && exit 0; \
	fi; \
	echo "make: there is no Node.js for the tests of clients. Install it (Debian: apt install $(NODE_PACKAGES))" >&2

# Unpacked instead of installed, so that none is started.
nginx: $(VENV)/.created ## Bring Debian's nginx into .venv for the tests of deploy/, where it is missing
	@if PATH="$$PATH:/usr/sbin" command -v nginx >/dev/null || [ -x $(VENV)/nginx/usr/sbin/nginx ]; then exit 0; fi; \
	if command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null; then \
		echo "make: bringing nginx into $(VENV) for the tests of deploy/"; \
		place="$(abspath $(VENV))/nginx"; mkdir -p "$$place"; \
		{ [ "$$(id -u)" != 0 ] || apt-get update -qq; } && (cd "$$place" && apt-get download -qq nginx 2>/dev/null) && \
			dpkg-deb -x "$$place"/nginx_*.deb "$$place" && exit 0; \
	fi; \
	echo "make: there is no nginx for the tests of deploy/. Install it (Debian: apt install nginx)" >&2

lint: $(VENV)/.dev ## Check format, style, types, the import contract, the scripts of the web map and deploy/
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/oxlint --deny-warnings web
	$(BIN)/hadolint Dockerfile
	$(BIN)/yamllint --strict deploy
	$(BIN)/check-jsonschema --builtin-schema vendor.compose-spec deploy/compose.yaml
	$(BIN)/kubernetes-validate --strict --quiet deploy/kubernetes.yaml

check: lint test ## All of lint and test

format: $(VENV)/.dev ## Format the code and mend what ruff can mend
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(VENV)/.runtime ## Print the benchmarks
	$(BIN)/joulepath bench $(ARGS)

prove: $(VENV)/.dev ## Prove the diagnosis where the cause is known and concealed
	$(BIN)/joulepath prove $(if $(RECORDINGS),--recordings "$(RECORDINGS)") $(ARGS)

lock: $(VENV)/.created ## Resolve the dependencies anew into both lock files
	$(PIP) install --quiet uv
	$(LOCK) --upgrade --extra build --extra manual --extra postgresql --output-file requirements.lock
	$(LOCK) --upgrade --extra build --extra dev --extra manual --extra proof --constraints requirements.lock --output-file requirements-dev.lock

clean: ## Remove the environment, caches and build output
	rm -rf $(VENV) build dist manual .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The stamps lie inside .venv, so that removing it starts over; a newer lock or pyproject.toml installs again.
$(VENV)/.runtime: requirements.lock pyproject.toml $(VENV)/.created
	$(PIP) install --quiet --require-hashes --requirement requirements.lock
	$(PIP) install --quiet --no-index --no-deps --no-build-isolation --editable .
	touch $@

$(VENV)/.dev: requirements-dev.lock $(VENV)/.runtime
	$(PIP) install --quiet --require-hashes --requirement requirements-dev.lock
	touch $@

$(VENV)/.manual: $(VENV)/.runtime $(wildcard docs/*.md docs/*/*.md docs/manual/*.py *.md)
	$(BIN)/python -m docs.manual
	touch $@

# Front ends that tests let ask the faces of other engines, by their lock file; no script of theirs is run.
$(VENV)/.clients: $(FRONT_ENDS)/package-lock.json $(VENV)/.created | node
	@if command -v npm >/dev/null; then set -x; \
		mkdir -p $(VENV)/clients && cp $(FRONT_ENDS)/package.json $(FRONT_ENDS)/package-lock.json $(VENV)/clients && \
		npm ci --prefix $(VENV)/clients --ignore-scripts --legacy-peer-deps --no-audit --no-fund --silent && touch $@; fi

# What generates clients from the OpenAPI document, in environments of its own, since it wants other versions.
$(VENV)/.generators: $(wildcard tests/app/clients/*/*lock*) $(VENV)/.created | node
	$(BIN)/python -m venv $(VENV)/generators/python
	$(VENV)/generators/python/bin/python -m pip --disable-pip-version-check install --quiet --require-hashes \
		--requirement tests/app/clients/python/requirements.lock
	@if command -v npm >/dev/null; then set -x; \
		cp tests/app/clients/typescript/package.json tests/app/clients/typescript/package-lock.json $(VENV)/generators && \
		npm ci --prefix $(VENV)/generators --silent --no-audit --no-fund --ignore-scripts && touch $@; fi

$(VENV)/.created:
	@found=""; bare=""; \
	for python in $(CANDIDATES); do \
		"$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || continue; \
		"$$python" -c 'import ensurepip, venv' 2>/dev/null || { bare="$${bare:-$$python}"; continue; }; \
		found="$$python"; break; \
	done; \
	if [ -z "$$found" ] && [ -n "$$bare" ]; then \
		echo "make: $$bare has no venv or ensurepip module. Install it (Debian, Ubuntu: apt install python3-venv)" \
			"or name another interpreter: make PYTHON=/path/to/python3" >&2; exit 1; \
	elif [ -z "$$found" ]; then \
		echo "make: no Python >= 3.11 found (tried $(CANDIDATES))." \
			"Install one or name it: make PYTHON=/path/to/python3" >&2; exit 1; \
	fi; \
	echo "make: creating $(VENV) with $$("$$found" --version)"; \
	"$$found" -m venv $(VENV)
	@touch $@
