# One recipe per step of `.ci/run`; `just` lists them. What they need is said there.

_list:
    @just --list --unsorted

# Run every check, as CI does
ci:
    .ci/run

# Pass the tests (the README's second command)
test:
    .ci/run test

# Check the formatting
fmt:
    .ci/run fmt

# Run clippy with warnings denied
lint:
    .ci/run lint

# Build the documentation with warnings denied
docs:
    .ci/run docs

# Validate every shipped configuration and calibration document
configs:
    .ci/run configs

# Check that the pure crates stay pure
purity:
    .ci/run purity

# Build the Python package's wheel and test it against the service; check recordings with what others read in them
python:
    .ci/run python

# Check the generated TypeScript types, and the console's scripts against them (needs npm)
typescript:
    .ci/run typescript

# Read recordings as Foxglove does (needs npm)
foxglove:
    .ci/run foxglove

# Kill the speaking service of a pair 100 times, stop it 50 times, cut the links of one 50 times, with 20 units at 200 Hz; print the
# pauses (a quarter of an hour; ISOTHERM_PAIR=UNITS,KILLS,STOPS,CUTS)
pair:
    cargo test --release --workspace --locked --test operators pair:: -- --include-ignored --skip soak --nocapture --test-threads=1

# Half an hour with 20 units at 200 Hz, swaps, commands, failovers and watchers, and a day of ticks at full speed; prints what grows
# (ISOTHERM_SOAK=MINUTES,UNITS,SECONDS_BETWEEN_FAILOVERS), with as many heaps as under systemd
soak:
    MALLOC_ARENA_MAX=2 cargo test --release --workspace --locked --test operators pair::soak:: -- --ignored --nocapture --test-threads=1

# Show the account of every fault of links, peers and machine, then of links in network namespaces (the latter need root)
faults:
    cargo test --release --workspace --locked --test faults -- --nocapture --test-threads=1
    cargo build --release --workspace --locked --bins
    tests/namespaces.sh

# Count the lines of code, without tests, comments and blank lines
lines:
    git ls-files '*.rs' | grep -vE '(^|/)(tests|benches|fuzz)/|/(tests|fixture)\.rs' | xargs awk ' \
        FNR == 1 { test = 0; next_is = 0 } /^#\[cfg\(test\)\]/ { next_is = 1; next } \
        next_is && /^mod .*\{/ { test = 1 } { next_is = 0 } \
        !test && !/^[ \t]*(\/\/|$)/ { lines++ } END { print lines }'

# Change the corrector's and the protocol's code, one place at a time, and see whether a test notices (needs cargo-mutants; SHARD=7/100:
# each hundredth place; minutes to days)
mutants shard="7/100":
    cargo mutants -p isotherm-correction -p isotherm-protocol --profile mutants --shard {{shard}} --sharding round-robin \
        --output target/mutants --minimum-test-timeout 120 -- --lib --tests

# Fuzz every reader, 10⁸ executions each (hours; ISOTHERM_FUZZ_SECONDS=N: seconds each; fuzz/run TARGET: one)
fuzz: fuzz-c
    fuzz/run

# Decode 10⁸ changed frames with the C header under the sanitizers of gcc and clang, those that are there (some minutes each)
fuzz-c:
    ISOTHERM_FUZZ=100000000 cargo test --release --locked -p isotherm-protocol --test versions no_frame_leads -- --nocapture

# Send 100 000 Imu messages through ROS 2's keys and the service; compare the latency with the project's own topics
ros-loop:
    ISOTHERM_ROS_MESSAGES=100000 cargo test --release --locked --workspace --test bridge -- --nocapture --test-threads=1

# Have hiroz, another implementation of ROS 2 over Zenoh, drive the bridge (with a build of its own, some ten minutes)
ros-peer:
    cargo build --release --locked --bin isotherm-ros
    cargo run --release --locked --manifest-path ros2/peer/Cargo.toml --target-dir target/ros-peer -- target/release/isotherm-ros 2000

# Measure how fast the clients decode: Python, and C with cc (after `just python`)
bench-clients:
    bash clients/bench.sh

# Fit six simulated coils and judge them against truth: how many times smaller drift gets (minutes)
accuracy:
    cargo test --release --locked -p isotherm-calibration --test calibration accuracy_on_simulated_coils -- --ignored --nocapture

# Count instructions per tick and compare them with the committed figures (needs valgrind)
instructions:
    .ci/run instructions

# Judge the unit, build the Debian package, try it in a clean root (needs root and debootstrap)
packages:
    .ci/run packages

# Boot a Debian with that package in a container, and have systemd start, watch and stop the service (needs root and systemd-nspawn)
boot:
    packaging/boot

# Build the programs without shared libraries, for containers
static:
    packaging/static

# Build the packages in two folders and compare the bytes (twice a full build; --rehearse: unoptimised)
reproducible *options:
    packaging/reproducible {{options}}

# Make a release in target/release-VERSION: checks, packages, static programs, SBOM, checksums (--rehearse: without checks, unoptimised)
release *options:
    packaging/release {{options}}

# Run the demo briefly and print its figures
demo:
    .ci/run demo

# Measure everything, into target/performance (about an hour; QUICK=1: whether all works)
performance:
    bash bench/performance.sh

# Pictures of the console in the browser at every size and colour, into target/console (needs chromium)
console-pictures:
    ISOTHERM_PICTURES="$PWD/target/console" cargo test --release --locked -p isotherm --test service web::pictures -- --nocapture

# Latency with 200 units at 200 Hz while pages of the console are open, beside latency without (after `cargo build --release --locked`)
console-cost:
    target/release/isotherm-bench chain --measure console --subject service --seconds 8
