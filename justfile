# The usual commands.
default:
    @just --list

# Format and lints, as every change must pass them
check:
    cargo fmt --all --check
    cargo clippy --all-targets --all-features -- -D warnings

# All tests, or those of a group: just test scenes
test group="":
    cargo test --profile quick --all-features {{ if group == "" { "" } else { "--test " + group } }}

# The documentation with formulas
docs:
    RUSTDOCFLAGS="--html-in-header $PWD/docs/katex.html" cargo doc --no-deps --all-features --open

# An example in release: just example tube_inflation
example name:
    cargo run --release --all-features --example {{ name }}

# A bench: just bench analysis
bench name:
    cargo bench -p rkpm-benches --bench {{ name }}

# Results beside those of another commit: just digits COMMIT (all examples that take less than minutes, or those that follow)
digits commit *examples:
    .ci/digits {{ commit }} {{ examples }}

# Instructions of some scenes over those of another commit (valgrind)
instructions commit *scenes:
    .ci/instructions {{ commit }} {{ scenes }}
