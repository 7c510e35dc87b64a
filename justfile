# The default picture, into domelight.exr and domelight.png.
render *ARGS:
    cargo run --release -- render {{ARGS}}

# All tests.
test:
    cargo test --workspace

# Format, lints, documentation and tests: what CI runs.
ci:
    .ci/run

# Formats the sources.
fmt:
    cargo fmt --all

# Criterion benches of the library.
bench *ARGS:
    cargo bench -p domelight {{ARGS}}

# The documentation in a browser.
doc:
    cargo doc --workspace --no-deps --open

# Licenses and advisories of the dependencies (needs cargo-deny).
deny:
    cargo deny check
