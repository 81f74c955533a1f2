# Everything a person or CI does with the project: `make demo` shows it, `make test` proves it.

BUSBAR := target/debug/busbar
CARGO := cargo
NPM := npm --prefix web --no-audit --no-fund

.PHONY: demo test bench soak setup web build lint test-web test-rust test-interop test-soak test-page clean

## a whole site on this machine: an imitated controller, the gateway, the page
demo: build
	$(BUSBAR) demo

## every test, with what it needs installed first
test: setup lint test-web test-rust test-interop test-soak test-page

## figures: processor time, beside a bare C echo and other libraries in the same run
bench: build .venv/.installed
	$(CARGO) run --locked --release -p busbar-bench
	$(NPM) run e2e:slow

## ten minutes of a thousand devices polled each second, then a thousand readers: missed polls, processor, memory
soak: web
	$(CARGO) build --locked --release -p busbar -p busbar-bench
	target/release/busbar-bench soak

setup: web/node_modules/.installed .venv/.installed
	scripts/setup

web/node_modules/.installed: web/package-lock.json
	$(NPM) ci
	touch $@

.venv/.installed: tests/interop/requirements.txt
	python3 -m venv .venv
	.venv/bin/pip install --quiet --disable-pip-version-check -r tests/interop/requirements.txt
	touch $@

## the page, as the binary carries it
web: web/dist/index.html

web/dist/index.html: web/node_modules/.installed $(shell find web/src web/public web/index.html web/vite.config.ts -type f 2>/dev/null)
	$(NPM) run build

build: web
	$(CARGO) build --locked

lint: web
	$(CARGO) fmt --all --check
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings
	$(NPM) run lint
	$(NPM) run check

test-web: web
	$(NPM) run api:check
	$(NPM) run size
	$(NPM) test

# Properties are tried with the same cases every time; run cargo test without this for cases of the day.
test-rust: export PROPTEST_RNG_SEED := 1
test-rust: web
	$(CARGO) test --locked --workspace

test-interop: build .venv/.installed
	.venv/bin/python -m pytest -q tests/interop

# Half a minute of the soak that judges counts only. A tenth of the devices and a fifth of the readers: debug builds of
# the controllers, the gateway and its readers share what may be two slow processors, and a poll that finds no
# processor is a missed one.
test-soak: build
	target/debug/busbar-bench soak --count --devices 100 --seconds 30 --readers 200

test-page: build
	$(NPM) run e2e

clean:
	$(CARGO) clean
	rm -rf web/dist web/node_modules .venv
