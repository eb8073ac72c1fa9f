//! `isotherm-bench`: see the library.

fn main() -> std::process::ExitCode {
    isotherm_bench::main().into()
}
