//! The kernels under divan, for who works on one: `cargo bench --bench kernel`, `cargo bench --bench kernel -- Zeeman`.
//!
//! An iteration is a pass of some thousand ticks; the rate beside it is in ticks. Figures that are told come from
//! `isotherm-bench kernel`, where rounds of all kernels take turns.

use divan::Bencher;
use divan::counter::ItemsCount;
use isotherm_bench::{Error, kernels};

fn main() -> Result<(), Error> {
    // A wrong result has no speed.
    kernels().try_for_each(|kernel| kernel?.check())?;
    divan::main();
    Ok(())
}

fn names() -> Vec<String> {
    kernels().flatten().map(|kernel| kernel.name().to_owned()).collect()
}

#[divan::bench(args = names())]
fn pass(bencher: Bencher<'_, '_>, name: &String) {
    let Some(mut kernel) = kernels().flatten().find(|kernel| kernel.name() == name) else { return };
    bencher.counter(ItemsCount::new(kernel.ticks())).bench_local(|| kernel.pass());
}
