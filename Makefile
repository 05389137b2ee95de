# `make` alone lists what there is.
.DEFAULT_GOAL := help
.PHONY: help demo test test-compose build lint bench pictures setup

# A folder with ASF+AMC(.zst) or BVH files for `make demo`; without it, trials are drawn from the sample motion.
DATA ?=

help: ## this list
	@printf 'Marey: full-body motion from a few measured points, or from cameras.\n\n'
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 24
	@printf '\nFirst time here? `make demo` sets everything up and shows what Marey does.\n'

demo: ## set up, build, reconstruct held-out trials and a person in front of cameras, say how well (DATA=dir: your trials)
	@scripts/demo.sh $(if $(DATA),"$(DATA)")

test: ## set up, then every test; those in compose too where a Docker engine answers
	@scripts/test.sh

test-compose: setup ## the tests against the compose stack, with a Docker engine of its own if none answers
	@scripts/docker-engine.sh scripts/test-compose.sh

build: setup ## the program, target/release/marey
	cargo build --release --locked -p marey

lint: setup ## formatting, clippy with warnings denied, layers of the crates, references
	@scripts/lint.sh

bench: setup ## every benchmark
	cargo bench --locked --workspace

pictures: setup ## the README's pictures anew (docs/pictures); the last one by Blender, where it is installed
	@scripts/pictures.sh

setup: ## install what is missing (PostgreSQL, a C compiler)
	@scripts/setup.sh
