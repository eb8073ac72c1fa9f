//! One accelerometer: the windows of its runs, what they must hold, and what they say of the board.

use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2;
use isotherm_protocol::document::{Curve, Shape};

use crate::document::tidy;
use crate::finding::AccelKind;
use crate::lsq::weighted::{beside_cubic, solve};
use crate::numbers::{Size, ends};

/// Least change of the board's temperature (°C).
const LEAST_RANGE_DEG_C: f64 = 10.0;
/// Change of the accelerometer's own temperature up to which a thermostat holds it (°C).
const HELD_DEG_C: f64 = 5.0;
/// What the board's temperature must have of its own beside that of the accelerometer (°C rms).
const OWN_DEG_C: f64 = 3.0;
/// Least difference of the input (m/s²), half a g.
const INPUT_M_PER_S2: f64 = 0.5 * STANDARD_GRAVITY_M_PER_S2;
/// Fewest windows.
const FEWEST: usize = 20;
/// Standard errors from which on a term counts.
const COUNTS: f64 = 3.0;
/// Room around the temperatures that were seen, to half a degree (°C).
const ROOM_DEG_C: f64 = 0.5;

/// Windows of an accelerometer.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Rows {
    /// The run of each.
    pub run: Vec<usize>,
    /// Specific force along its axis (m/s²).
    pub input: Vec<f64>,
    /// What it showed with r = 1, less that (m/s²).
    pub error: Vec<f64>,
    /// Temperature of the board (°C).
    pub board_deg_c: Vec<f64>,
    /// Its own temperature (°C).
    pub own_deg_c: Vec<f64>,
}

/// What was found of one accelerometer.
#[derive(Debug, Clone, PartialEq)]
pub struct Ratio {
    /// x by powers of the board's temperature less the reference, from the first.
    pub x: Vec<f64>,
    /// Their standard errors.
    pub sigmas: Vec<f64>,
    /// Where r is 1 (°C).
    pub reference_deg_c: f64,
    /// Temperatures of the board that were seen (°C).
    pub range_deg_c: [f64; 2],
    /// Whether its own temperature moved, and slopes of K and S stand beside.
    pub beside_own: bool,
    /// What is to be said beside.
    pub doubt: Option<AccelKind>,
}

impl Rows {
    /// Whether a window counts.
    fn good(&self, row: usize) -> bool {
        [&self.error, &self.input, &self.board_deg_c, &self.own_deg_c]
            .iter()
            .all(|column| column.get(row).is_some_and(|value| value.is_finite()))
    }

    /// What must hold before anything is fitted.
    fn check(&self, channels: &[String; 2]) -> Result<[f64; 2], AccelKind> {
        let rows: Vec<usize> = (0..self.run.len()).filter(|row| self.good(*row)).collect();
        if rows.len() < FEWEST {
            return Err(AccelKind::FewWindows { windows: rows.len() });
        }
        let board = ends(rows.iter().map(|row| self.board_deg_c[*row]));
        if board[1] - board[0] < LEAST_RANGE_DEG_C {
            return Err(AccelKind::BoardStays {
                channel: channels[0].clone(),
                range: board,
                needed: LEAST_RANGE_DEG_C,
            });
        }
        let input = ends(rows.iter().map(|row| self.input[*row]));
        if input[1] - input[0] < INPUT_M_PER_S2 {
            return Err(AccelKind::SameInput { spread: [input[1] - input[0], INPUT_M_PER_S2] });
        }
        let middle = 0.5 * (input[0] + input[1]);
        let [low, high] = [false, true].map(|above| {
            let own = rows.iter().filter(|row| (self.input[**row] > middle) == above);
            ends(own.map(|row| self.board_deg_c[*row]))
        });
        let shared = low[1].min(high[1]) - low[0].max(high[0]);
        if shared < LEAST_RANGE_DEG_C {
            return Err(AccelKind::OtherTemperatures { shared: [shared, LEAST_RANGE_DEG_C] });
        }
        Ok(board)
    }

    /// Whether the accelerometer's own temperature moves.
    fn moves(&self) -> bool {
        let [low, high] = ends(self.own_deg_c.iter().copied());
        high - low > HELD_DEG_C
    }

    /// What the board's temperature has of its own beside a cubic of the accelerometer's (°C rms).
    fn own_of_board(&self) -> Option<f64> {
        let range = ends(self.own_deg_c.iter().copied());
        let left = beside_cubic(&self.own_deg_c, range, &self.board_deg_c, &self.weights())?;
        Some(Size::of(&left).rms)
    }

    fn weights(&self) -> Vec<f64> {
        (0..self.run.len()).map(|row| f64::from(u8::from(self.good(row)))).collect()
    }

    /// Finds the ratio; `reference_deg_c` is where it is 1, `channels` are those of board and accelerometer.
    ///
    /// # Errors
    /// Why it cannot be told.
    pub fn fit(&self, reference_deg_c: Option<f64>, channels: &[String; 2]) -> Result<Ratio, AccelKind> {
        let range = self.check(channels)?;
        let beside_own = self.moves();
        if beside_own {
            let own = self.own_of_board().unwrap_or(0.0);
            if own < OWN_DEG_C {
                return Err(AccelKind::BoardFollows { channels: channels.clone(), own: [own, OWN_DEG_C] });
            }
        }
        let reference = reference_deg_c.unwrap_or_else(|| libm::round(0.5 * (range[0] + range[1])));
        let few = || AccelKind::FewWindows { windows: self.run.len() };
        let mut found = self.solve(reference, 2, beside_own).ok_or_else(few)?;
        // A bend that is none would only bend what lies outside.
        if found.get(1).is_none_or(|[c, sigma]| c.abs() <= COUNTS * sigma) {
            found = self.solve(reference, 1, beside_own).ok_or_else(few)?;
        }
        let slope = found.pop().filter(|[slope, sigma]| slope.abs() > COUNTS * sigma);
        let doubt = slope.map(|slope| AccelKind::BiasFollowsBoard { slope });
        Ok(Ratio {
            x: found.iter().map(|[c, _]| *c).collect(),
            sigmas: found.iter().map(|[_, sigma]| *sigma).collect(),
            reference_deg_c: reference,
            range_deg_c: range,
            beside_own,
            doubt,
        })
    }

    /// Coefficients of x with their standard errors, and behind them the slope of a bias over the board (m/s² per °C).
    fn solve(&self, reference: f64, degree: i32, beside_own: bool) -> Option<Vec<[f64; 2]>> {
        let runs = self.run.iter().max()? + 1;
        let of = |value: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..self.run.len()).map(value).collect() };
        let board = |row: usize| self.board_deg_c[row] - reference;
        let mut columns: Vec<Vec<f64>> =
            (1..=degree).map(|power| of(&|row| self.input[row] * board(row).powi(power))).collect();
        columns.push(of(&board));
        let asked = columns.len();
        columns.extend((0..runs).map(|run| of(&|row| f64::from(u8::from(self.run[row] == run)))));
        if beside_own {
            let middle = Size::of(&self.own_deg_c).mean;
            for power in [1, 2] {
                let own = |row: usize| (self.own_deg_c[row] - middle).powi(power);
                columns.push(of(&own));
                columns.push(of(&|row| self.input[row] * own(row)));
            }
        }
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let solution = solve(&columns, &self.error, &self.weights(), None)?;
        let pairs = solution.coefficients.iter().zip(&solution.sigmas).map(|(c, sigma)| [*c, *sigma]);
        Some(pairs.take(asked).collect())
    }
}

impl Ratio {
    /// r − 1 (ppm) at a temperature of the board (°C).
    pub fn error_ppm(&self, deg_c: f64) -> f64 {
        let away = deg_c - self.reference_deg_c;
        let x = self.x.iter().rev().fold(0.0, |sum, c| (sum + c) * away);
        1e6 * (1.0 / (1.0 + x) - 1.0)
    }

    /// As the document has it: 1/(1 + x) − 1 = −x + x² − …, whose next term is some 1e-9.
    pub fn curve(&self) -> Curve {
        let mut coefficients = vec![0.0; 2 * self.x.len() + 1];
        for (i, a) in self.x.iter().enumerate() {
            coefficients[i + 1] -= 1e6 * a;
            for (j, b) in self.x.iter().enumerate() {
                coefficients[i + j + 2] += 1e6 * a * b;
            }
        }
        let [low, high] = self.range_deg_c;
        let shape = Shape::Polynomial {
            reference: self.reference_deg_c,
            coefficients: coefficients.into_iter().map(tidy).collect(),
            range: [libm::floor(2.0 * (low - ROOM_DEG_C)) / 2.0, libm::ceil(2.0 * (high + ROOM_DEG_C)) / 2.0],
        };
        Curve::new(shape)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::noise;

    /// Two runs at ±1 g; board −25…55…−25 °C; the accelerometer as `own` has it.
    fn rows(inputs: [f64; 2], own: impl Fn(f64, f64) -> f64, bias_of_board: f64) -> Rows {
        let mut noise = noise();
        let mut rows = Rows::default();
        for (run, input) in inputs.into_iter().enumerate() {
            for window in 0..400_u16 {
                let phase = f64::from(window) / 200.0;
                let board = if phase < 1.0 { -25.0 + 80.0 * phase } else { 135.0 - 80.0 * phase };
                let away = board - 15.0;
                let ratio = 1.0 + 20e-6 * away + 0.03e-6 * away * away;
                let t = own(board, f64::from(window));
                let scale = 1.0 + 1e-4 * (t - 40.0);
                let shown = input * scale / ratio + 2e-3 * (t - 40.0) + 0.01 + bias_of_board * away;
                rows.run.push(run);
                rows.input.push(input);
                rows.error.push(shown - input + 1e-5 * noise());
                rows.board_deg_c.push(board);
                rows.own_deg_c.push(t);
            }
        }
        rows
    }

    fn channels() -> [String; 2] {
        ["board".to_owned(), "accel".to_owned()]
    }

    #[track_caller]
    fn right(found: &Ratio, within_ppm: f64) {
        for deg_c in [-25.0, 0.0, 15.0, 40.0, 55.0] {
            let away = deg_c - 15.0;
            let truth = 20.0 * away + 0.03 * away * away;
            let curve = found.curve().shape().at(deg_c).unwrap();
            assert!((found.error_ppm(deg_c) - truth).abs() < within_ppm, "{deg_c}: {found:?}");
            assert!((curve - found.error_ppm(deg_c)).abs() < 1e-2, "{deg_c}: {curve}");
        }
    }

    #[test]
    fn a_thermostat_leaves_the_board_alone() {
        let found = rows([9.8, -9.8], |_, _| 40.0, 0.0).fit(Some(15.0), &channels()).unwrap();
        assert!(!found.beside_own && found.doubt.is_none(), "{found:?}");
        right(&found, 1.0);
    }

    #[test]
    fn beside_a_temperature_of_its_own_scale_and_bias_are_told_apart() {
        let own = |_: f64, window: f64| 40.0 + 20.0 * libm::sin(window / 37.0);
        let found = rows([9.8, -9.8], own, 0.0).fit(Some(15.0), &channels()).unwrap();
        assert!(found.beside_own, "{found:?}");
        right(&found, 2.0);
    }

    #[test]
    fn what_does_not_tell_the_ratio_is_refused_by_its_kind() {
        let held = |_: f64, _: f64| 40.0;
        let refused = |rows: Rows| rows.fit(None, &channels()).unwrap_err();
        assert!(matches!(refused(rows([9.8, 9.7], held, 0.0)), AccelKind::SameInput { .. }));
        let with_board = rows([9.8, -9.8], |board, _| board + 5.0, 0.0);
        assert!(matches!(refused(with_board), AccelKind::BoardFollows { .. }));
        let mut still = rows([9.8, -9.8], held, 0.0);
        still.board_deg_c.fill(20.0);
        assert!(matches!(refused(still), AccelKind::BoardStays { .. }));
        let mut apart = rows([9.8, -9.8], held, 0.0);
        apart
            .board_deg_c
            .iter_mut()
            .zip(&apart.run)
            .for_each(|(t, run)| *t += if *run == 1 { 90.0 } else { 0.0 });
        assert!(matches!(refused(apart), AccelKind::OtherTemperatures { .. }));
        let mut few = rows([9.8, -9.8], held, 0.0);
        few.error[10..].fill(f64::NAN);
        assert!(matches!(refused(few), AccelKind::FewWindows { windows: 10 }));
    }

    #[test]
    fn what_follows_the_board_and_not_the_input_is_told() {
        let found = rows([9.8, -9.8], |_, _| 40.0, 3e-5).fit(Some(15.0), &channels()).unwrap();
        let Some(AccelKind::BiasFollowsBoard { slope: [slope, _] }) = found.doubt else {
            panic!("{found:?}")
        };
        assert!((slope / 3e-5 - 1.0).abs() < 0.02, "{slope}");
        right(&found, 1.0);
    }
}
