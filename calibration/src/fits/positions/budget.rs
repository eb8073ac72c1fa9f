//! The error budget of a calibration that is planned (004, equations 3 to 7; models §9), before anyone books the chamber.

use clap::Args;
use isotherm_pages::Table;
use serde_json::json;

use super::doubts::unseen;
use super::model::{Degrees, Taken};
use super::plan::Plan;
use super::solve::{Positions, Weights, guesses};
use crate::document::by_name;
use crate::limits::{above_0, from_0, within};
use crate::numbers::{ARCSEC_PER_RAD, norm, real};
use crate::report::{Report, counted, short};

/// What is planned; the defaults are the example of 004, with quartz accelerometers.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct Budget {
    /// σ1: positioning of the stand (″)
    #[arg(skip)]
    pub positioning_arcsec: f64,
    /// σ2: run-out of its axes (″)
    #[arg(skip)]
    pub run_out_arcsec: f64,
    /// Planned: white noise of an accelerometer (V²·s)
    #[arg(long, hide_short_help = true, value_name = "Q", default_value_t = 3e-9, requires = "budget", value_parser = above_0)]
    pub noise: f64,
    /// Planned: time in each position (s)
    #[arg(long, hide_short_help = true, value_name = "SECONDS", default_value_t = 30.0, requires = "budget", value_parser = above_0)]
    pub seconds: f64,
    /// Planned: output of an accelerometer at 1 g (V)
    #[arg(long, hide_short_help = true, value_name = "V", default_value_t = 1.0, requires = "budget", value_parser = above_0)]
    pub scale: f64,
    /// Planned: thermal expansion of housing and sensor (1e-6/°C)
    #[arg(long, hide_short_help = true, value_name = "PPM", num_args = 2, default_values_t = [22.9, 15.0], requires = "budget", allow_negative_numbers = true, value_parser = within(-1000.0, 1000.0))]
    pub expansion: Vec<f64>,
    /// Planned: calibration temperature and highest temperature inside (°C)
    #[arg(long, hide_short_help = true, value_name = "DEG_C", num_args = 2, default_values_t = [20.0, 85.0], requires = "budget", allow_hyphen_values = true, value_parser = within(-100.0, 200.0))]
    pub temperatures: Vec<f64>,
    /// Planned: error of the measured temperature (°C)
    #[arg(long, hide_short_help = true, value_name = "DEG_C", default_value_t = 0.2, requires = "budget", value_parser = from_0)]
    pub temperature_error: f64,
    /// Planned: turn of an axis with temperature (″/°C); quartz 1.5, silicon up to 6
    #[arg(long, hide_short_help = true, value_name = "ARCSEC", default_value_t = 1.5, requires = "budget", value_parser = from_0)]
    pub axis_rate: f64,
    /// Planned: hysteresis of an axis over thermal cycles (″); quartz 5 to 15, silicon 15 to 60, or as measured
    #[arg(long, hide_short_help = true, value_name = "ARCSEC", default_value_t = 5.0, requires = "budget", value_parser = from_0)]
    pub hysteresis: f64,
}

/// `k_C` of 004 for accelerometers of quartz and of silicon (″/°C).
pub const TYPICAL_ARCSEC_PER_DEG_C: [(&str, f64); 2] = [("quartz", 1.5), ("silicon", 6.0)];

impl Budget {
    /// White noise of a mean over τ as an angle (″).
    pub fn noise_arcsec(&self) -> f64 {
        ARCSEC_PER_RAD * (self.noise / self.seconds).sqrt() / self.scale
    }

    /// Error of one element of C by the stand and the noise (″): 004, equation 4.
    pub fn stand_arcsec(&self) -> f64 {
        2.0 * norm([self.positioning_arcsec, self.run_out_arcsec, self.noise_arcsec()])
    }

    /// Largest plastic deformation of the housing (″): equation 6.
    pub fn housing_arcsec(&self) -> f64 {
        let [housing, sensor] = pair(&self.expansion);
        let [cold, hot] = pair(&self.temperatures);
        ARCSEC_PER_RAD * 0.1 * (housing - sensor) * 1e-6 * (hot - cold)
    }

    /// Error by the measured temperature for axes that turn with `rate` (″): equation 7.
    pub fn temperature_arcsec(&self, rate_arcsec_per_deg_c: f64) -> f64 {
        self.temperature_error * rate_arcsec_per_deg_c
    }

    /// What turns an axis between calibrations (″): hysteresis, housing, measured temperature; equation 5.
    pub fn thermal_arcsec(&self) -> f64 {
        let measured = self.temperature_arcsec(self.axis_rate);
        self.hysteresis.hypot(self.housing_arcsec()).hypot(measured)
    }

    /// Root sum of squares with stand and noise (″).
    pub fn total_arcsec(&self) -> f64 {
        self.stand_arcsec().hypot(self.thermal_arcsec())
    }

    /// Standard error of the elements of C that the least-squares fit of a plan will state, mean and largest (″); `None` where
    /// the plan does not determine them.
    pub fn of_plan(&self, plan: &Plan, levelling_rad: f64) -> Option<[f64; 2]> {
        let taken = |position| Taken {
            position,
            outputs: plan.up(position, [0.0; 3]).map(|c| c * self.scale).to_vec(),
            ratio: vec![1.0; 3],
            duration_s: self.seconds,
            sensor_t: vec![0.0; 3],
            axes_t: 0.0,
            level: 0,
        };
        let taken: Vec<Taken> = (0..plan.positions.len()).map(taken).collect();
        let guess = guesses(plan, &taken, 3).ok()?;
        let positioning = self.positioning_arcsec.hypot(self.run_out_arcsec) / ARCSEC_PER_RAD;
        let weights = Weights { intensity: vec![self.noise; 3], positioning_rad: positioning, levelling_rad };
        let all = Positions { plan, taken: &taken, guess: &guess, weights: &weights, degrees: Degrees::NONE };
        let found = all.planned().ok()?;
        let covariance = found.axes_covariance(0);
        let sigma: Vec<f64> = covariance.diagonal().iter().map(|v| v.sqrt() * ARCSEC_PER_RAD).collect();
        let mean = (sigma.iter().map(|s| s * s).sum::<f64>() / real(sigma.len())).sqrt();
        Some([mean, sigma.iter().copied().fold(0.0, f64::max)])
    }

    /// What this plan comes to: how well an axis is known by its own fit, and with what the housing and the measured temperature add (″).
    fn words(plan: &Plan, known: Option<[f64; 2]>) -> String {
        let count = counted(plan.positions.len(), "position", "positions");
        if let Some([known, later]) = known {
            return format!(
                "an axis will be known to {known:.1}″ (one sigma) by the plan's {count}, to {later:.1}″ with hysteresis, \
                 housing and measured temperature"
            );
        }
        let all: Vec<usize> = (0..plan.positions.len()).collect();
        let lacking = unseen(plan, &all, "none", "they do not spread enough");
        format!("the plan's {count} will not determine C: {lacking}. Show each case axis up and down")
    }

    /// All that is said of it.
    pub fn report(&self, plan: &Plan, levelling_rad: f64) -> Report {
        let of_plan = self.of_plan(plan, levelling_rad);
        let known = of_plan.map(|[mean, _]| [mean, mean.hypot(self.thermal_arcsec())]);
        let mut report = Report::saying("Error budget of positions", "budget", Self::words(plan, known));
        let formula = "By the formula of 004, which adds its errors independent of the plan";
        report.notes.push(format!("{formula}: {:.1}″.", self.total_arcsec()));
        let typical =
            TYPICAL_ARCSEC_PER_DEG_C.map(|(name, rate)| (name, rate, self.temperature_arcsec(rate)));
        let words = typical.map(|(name, rate, error)| format!("{error:.1}″ for {name} ({rate} ″/°C)"));
        report.notes.push(format!("Error by the measured temperature: {}.", words.join(", ")));
        if let Some([mean, largest]) = of_plan {
            let level =
                format!(", with a level known to {:.0}″ (--levelling)", levelling_rad * ARCSEC_PER_RAD);
            report.notes.push(format!(
                "The weighted least-squares fit of the plan uses every position for every element{}: it will state \
                 {mean:.1}″ on average, {largest:.1}″ at most.",
                if plan.tells_level() { "" } else { level.as_str() }
            ));
        }
        report.tables.push(("By the formula".to_owned(), self.rows()));
        report.figures = json!({
            "noise_arcsec": self.noise_arcsec(),
            "stand_arcsec": self.stand_arcsec(),
            "housing_arcsec": self.housing_arcsec(),
            "temperature_arcsec": self.temperature_arcsec(self.axis_rate),
            "temperature_typical_arcsec": by_name(typical.map(|(name, _, error)| (name, json!(error)))),
            "hysteresis_arcsec": self.hysteresis,
            "thermal_arcsec": self.thermal_arcsec(),
            "total_arcsec": self.total_arcsec(),
            "positions": plan.positions.len(),
            "determined": of_plan.is_some(),
            "known_arcsec": known.map(|[_, later]| later),
            "fit_mean_arcsec": of_plan.map(|[mean, _]| mean),
            "fit_largest_arcsec": of_plan.map(|[_, largest]| largest),
        });
        report
    }

    /// The budget as a table.
    pub fn rows(&self) -> Table {
        let [housing, sensor] = pair(&self.expansion);
        let [cold, hot] = pair(&self.temperatures);
        let row = |what: String, formula: String, value: f64| vec![what, formula, format!("{value:.1}")];
        let rows = vec![
            row("positioning σ1".into(), "given".into(), self.positioning_arcsec),
            row("run-out σ2".into(), "given".into(), self.run_out_arcsec),
            row(
                "white noise".into(),
                format!("ρ·√(Q/τ)/K, Q {}, τ {} s, K {}", short(self.noise), self.seconds, self.scale),
                self.noise_arcsec(),
            ),
            row("stand and noise [004 eq. 4]".into(), "2·√(σ1² + σ2² + noise²)".into(), self.stand_arcsec()),
            row(
                "housing [004 eq. 6]".into(),
                format!("0.1·({housing} − {sensor})·10⁻⁶·({hot} − {cold}) rad"),
                self.housing_arcsec(),
            ),
            row(
                "measured temperature [004 eq. 7]".into(),
                format!("{} °C · {} ″/°C", self.temperature_error, self.axis_rate),
                self.temperature_arcsec(self.axis_rate),
            ),
            row("hysteresis of the axis [004 table 1]".into(), "given".into(), self.hysteresis),
            row(
                "between calibrations [004 eq. 5]".into(),
                "root of the sum of squares of the last three".into(),
                self.thermal_arcsec(),
            ),
            row("total".into(), "with stand and noise".into(), self.total_arcsec()),
        ];
        Table::of(["", "", "″"], rows)
    }
}

/// The two values of an option.
fn pair(values: &[f64]) -> [f64; 2] {
    <[f64; 2]>::try_from(values).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of 004, with quartz accelerometers.
    fn example() -> Budget {
        Budget {
            positioning_arcsec: 5.0,
            run_out_arcsec: 2.0,
            noise: 3e-9,
            seconds: 30.0,
            scale: 1.0,
            expansion: vec![22.9, 15.0],
            temperatures: vec![20.0, 85.0],
            temperature_error: 0.2,
            axis_rate: 1.5,
            hysteresis: 5.0,
        }
    }

    #[test]
    fn the_examples_of_the_paper() {
        let budget = example();
        // 11.52″ in 004 (11.53 with its own numbers), 11″, 0.3″ and 1.2″.
        assert!((budget.stand_arcsec() - 11.53).abs() < 0.005, "{}", budget.stand_arcsec());
        assert!((budget.housing_arcsec() - 10.59).abs() < 0.005, "{}", budget.housing_arcsec());
        assert!((budget.temperature_arcsec(1.5) - 0.3).abs() < 1e-12);
        assert!((budget.temperature_arcsec(6.0) - 1.2).abs() < 1e-12);
        assert!((budget.total_arcsec() - 16.44).abs() < 0.005, "{}", budget.total_arcsec());
        // 12…19″ for quartz (a hysteresis of 5…15″), 19…61″ for silicon (15…60″).
        for (hysteresis, axis_rate, total) in
            [(5.0, 1.5, 12.0), (15.4, 1.5, 19.0), (15.4, 6.0, 19.0), (60.0, 6.0, 61.0)]
        {
            let of = Budget { axis_rate, hysteresis, ..budget.clone() };
            assert!((of.thermal_arcsec() - total).abs() < 0.5, "{}", of.thermal_arcsec());
        }
        let text = budget.report(&Plan::twelve(), 3e-4).whole_text();
        insta::assert_snapshot!(text);
    }

    #[test]
    fn the_first_line_is_of_the_plan() {
        let budget = example();
        let first = |plan: &Plan| budget.report(plan, 60.0 / ARCSEC_PER_RAD).headline();
        let [known, _] = budget.of_plan(&Plan::six(), 60.0 / ARCSEC_PER_RAD).unwrap();
        let later = known.hypot(budget.thermal_arcsec());
        assert!(known > 20.0 && later > known && later < known + 5.0, "{known} {later}");
        let mut flat = Plan::twelve();
        flat.positions.retain(|position| !position.name.starts_with('Z'));
        insta::assert_snapshot!([Plan::twelve(), Plan::six(), flat].map(|plan| first(&plan)).join("\n"));
    }

    #[test]
    fn a_plan_without_a_stand_is_budgeted_as_it_is_fitted() {
        use crate::fits::positions::plan::Attitude;
        let mut plan = Plan::twelve();
        for (index, position) in plan.positions.iter_mut().enumerate() {
            position.attitude = Attitude::Up(Plan::twelve().up(index, [0.0; 3]).map(f64::round));
        }
        // Two pairs for every element, each out of level by the stand's 60″: half of that, as the fit says.
        let [mean, most] = example().of_plan(&plan, 60.0 / ARCSEC_PER_RAD).unwrap();
        assert!((mean - 30.1).abs() < 0.2 && (most - 30.1).abs() < 0.2, "{mean} {most}");
        plan.positions.retain(|position| !position.name.starts_with('Z'));
        assert!(example().of_plan(&plan, 3e-4).is_none(), "z is seen neither up nor down");
    }

    #[test]
    fn twelve_positions_know_more_than_six() {
        let budget = example();
        let [twelve, _] = budget.of_plan(&Plan::twelve(), 3e-4).unwrap();
        let [six, _] = budget.of_plan(&Plan::six(), 3e-4).unwrap();
        // Four positions for every element: σ1 and σ2 by half, and what noise adds.
        assert!(twelve > 0.5 * 29.0_f64.sqrt() && twelve < 0.7 * 29.0_f64.sqrt(), "{twelve}");
        // The level is out by 60″, and nothing tells it from the axes.
        assert!(six > 20.0, "{six}");
    }
}
