//! Several units at once.

use isotherm_protocol::document::Origin;

use super::ThermalArgs;
use super::work::Work;
use crate::cli::bar::Bar;
use crate::cli::print;
use crate::error::Error;
use crate::report::{BatchTable, in_parallel, of_unit};

impl ThermalArgs {
    /// Fits several units in parallel, and closes with one table.
    pub(super) fn batch(&self, work: &[Work], origin: &Origin) -> Result<(), Error> {
        let bar = Bar::at_work("fitting units");
        let made = in_parallel(
            work,
            |_| (),
            |one| {
                let fitted = one.fit(origin.clone(), ())?;
                self.give_out(&fitted, |path| of_unit(path, one.unit.as_str()))?;
                Ok::<_, Error>(fitted)
            },
        );
        bar.finish();
        let mut table = BatchTable::default();
        let (mut refusals, mut reports) = (Vec::new(), Vec::new());
        for (one, made) in work.iter().zip(made) {
            match made {
                Ok(fitted) => {
                    table.add(one.unit.as_str(), Ok(fitted.report.verdicts.clone()));
                    refusals.extend(fitted.report.refusals());
                    reports.push(fitted.report.to_json());
                }
                Err(error) => {
                    table.add(one.unit.as_str(), Err(error.to_string()));
                    refusals.push(format!("{}: {error}", one.unit));
                }
            }
        }
        if self.json {
            let whole = serde_json::json!({ "batch": table.to_json(), "units": reports });
            print(format!("{whole}\n").as_bytes())?;
        } else {
            print(table.to_text().as_bytes())?;
        }
        if refusals.is_empty() || self.accept_partial { Ok(()) } else { Err(Error::Refused(refusals)) }
    }
}
