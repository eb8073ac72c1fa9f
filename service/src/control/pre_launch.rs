//! The result of a pre-launch calibration: an overlay document, kept, and put in force where that was asked for.

use std::sync::Arc;
use std::time::SystemTime;

use isotherm_correction::operation::State;
use isotherm_correction::prelaunch::{GyroConstants, Outcome};
use isotherm_correction::units::AngularRate;
use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{self, Created};
use isotherm_protocol::history::{AuditEvent, CommandRecord, Source, WallTime};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::overlay::{GyroOverlay, OVERLAY_SCHEMA, Overlay, PreLaunchRecord};

use super::command::{PRE_LAUNCH_ENDED, PreLaunchRun};
use super::document::Document;
use super::manager::Worker;
use super::queue::PreLaunchEnd;
use super::request::Request;
use super::revision::Record;

impl Worker {
    /// Takes the end of a pre-launch calibration, whatever it came to.
    pub(super) fn pre_launch_ended(&mut self, unit: &UnitId, end: &PreLaunchEnd) {
        let Some(outcome) = &end.outcome else {
            // An abort is in the audit file as a command.
            if let Some(reason) = &end.given_up {
                self.note_given_up(unit, reason);
            }
            return;
        };
        let Some(record) = self.records.get_mut(unit) else { return };
        let Some(run) = record.pre_launch.take() else { return };
        let came_to = match outcome {
            Outcome::Refused(reasons) => {
                let document = record.document().and_then(|document| document.content());
                let gyros: Vec<_> = document.as_ref().map(|it| names(it).collect()).unwrap_or_default();
                let reasons: Vec<_> =
                    reasons.iter().map(|reason| named(&reason.to_string(), &gyros)).collect();
                Err(reasons.join("; "))
            }
            Outcome::Accepted(constants) => self.keep_result(unit, end, constants, &run),
        };
        match &came_to {
            Ok(words) => tracing::info!(%unit, "pre-launch calibration: {words}"),
            Err(reason) => {
                tracing::warn!(%unit, "pre-launch calibration refused, nothing has changed: {reason}");
            }
        }
        let accepted = came_to.is_ok();
        self.write_end(unit, &run.by, accepted, came_to.unwrap_or_else(|reason| reason));
    }

    /// Tells and writes down that it was given up, and not by a command.
    fn note_given_up(&mut self, unit: &UnitId, reason: &str) {
        tracing::warn!(%unit, "pre-launch calibration ended, the constants stay: {reason}");
        // Left in its place: the next one may have begun.
        let run = self.records.get(unit).and_then(|record| record.pre_launch.as_ref());
        let by = run.map(|run| run.by.clone()).unwrap_or_default();
        self.write_end(unit, &by, false, format!("given up: {reason}"));
    }

    fn write_end(&mut self, unit: &UnitId, by: &str, accepted: bool, reason: String) {
        let state_after = self.intake.present(unit).map_or(State::Standby, |present| present.state);
        let record = CommandRecord {
            command: PRE_LAUNCH_ENDED.to_owned(),
            accepted,
            reason: Some(reason),
            state_before: State::PreLaunchCalibration.to_string(),
            state_after: state_after.to_string(),
            last_sequence: self.intake.with(unit, |actor| actor.last_sequence()).flatten(),
            order: None,
        };
        self.note(Some(unit), by, AuditEvent::Command(record), "the pre-launch calibration");
    }

    /// Makes the overlay, keeps it, puts it in force where that was asked for; in words what became of it.
    fn keep_result(
        &mut self,
        unit: &UnitId,
        end: &PreLaunchEnd,
        constants: &[GyroConstants],
        run: &PreLaunchRun,
    ) -> Result<String, String> {
        let record = self.records.get(unit);
        let last = record.and_then(Record::last);
        let is_last = last.is_some_and(|last| last.number.counter == end.revision);
        let base = if is_last {
            record.and_then(Record::document).cloned()
        } else {
            let set = self.store.by_revision(unit, end.revision);
            set.and_then(|set| Document::stored(&self.store, set).ok()).map(Arc::new)
        };
        let Some((base, digest)) = base.and_then(|base| base.digest().map(|digest| (base, digest))) else {
            return Err(format!(
                "revision {} never was a document, so there is no base for an overlay",
                end.revision
            ));
        };
        let Some(content) = base.content() else {
            return Err(format!("the document of revision {} can no longer be read", end.revision));
        };
        let found = overlay((digest, &content), end, constants, run);
        let overlay = base.layers.as_ref().map_or(found.clone(), |layers| found.after(&layers.overlay));
        let text =
            overlay.to_toml().map_err(|error| format!("the overlay cannot be written out: {error}"))?;
        let digest = self.store.put_overlay(text.as_bytes()).map_err(|error| error.to_string())?;
        if let Some(record) = self.records.get_mut(unit) {
            record.overlay = Some(digest);
            self.tell_account(unit);
        }
        if !run.order.install {
            return Ok(format!("stored as overlay {digest}, not put in force, as requested"));
        }
        if !is_last {
            return Ok(format!(
                "stored as overlay {digest} of revision {}, not put in force: another calibration was accepted \
                 meanwhile",
                end.revision
            ));
        }
        let request = Request {
            unit: Some(unit.clone()),
            name: "pre-launch calibration".to_owned(),
            source: Source::PreLaunch,
            overlay: None,
            options: SwapOptions { by: run.by.clone(), any_serial: true, ..SwapOptions::default() },
        };
        let reply = self.swap(&request, text.as_bytes(), None);
        if reply.outcome == SwapOutcome::Refused {
            let problems: Vec<_> = reply.problems.iter().map(|problem| problem.message.clone()).collect();
            return Err(format!("stored as overlay {digest}, not put in force: {}", problems.join("; ")));
        }
        Ok(format!("stored as overlay {digest}, in force as revision {}", reply.revision))
    }
}

/// The overlay on the document itself, whether or not an overlay was in force.
fn overlay(
    (digest, document): (Digest, &document::Document),
    end: &PreLaunchEnd,
    constants: &[GyroConstants],
    run: &PreLaunchRun,
) -> Overlay {
    let deg_per_h = |rate: f64| AngularRate::from_rad_per_s(rate).as_deg_per_h();
    let gyros = names(document).zip(constants).map(|(name, found)| GyroOverlay {
        name: name.to_owned(),
        static_bias_change_deg_per_h: deg_per_h(found.static_bias_change_rad_per_s),
        static_bias_sigma_deg_per_h: deg_per_h(found.static_bias_sigma_rad_per_s),
        magnetic_bias_change_deg_per_h: found.magnetic_bias_change_rad_per_s.map(deg_per_h),
        magnetic_bias_sigma_deg_per_h: found.magnetic_bias_sigma_rad_per_s.map(deg_per_h),
    });
    let place = run.order.place;
    #[expect(clippy::cast_precision_loss, reason = "a pre-launch calibration is shorter than 2⁵³ ns")]
    let duration_s = end.end_ns.saturating_sub(end.start_ns) as f64 * 1e-9;
    Overlay {
        schema: OVERLAY_SCHEMA,
        overlay_of: digest.to_string(),
        unit: document.unit.clone(),
        created: now(),
        note: None,
        gyro: gyros.collect(),
        pre_launch: Some(PreLaunchRecord {
            latitude_deg: place.latitude_deg,
            heading_deg: place.heading_deg,
            pitch_roll_deg: place.pitch_roll_deg,
            duration_s,
            start_ns: end.start_ns,
            end_ns: end.end_ns,
            mean_temperature_deg_c: constants.iter().map(mean_temperature_deg_c).collect(),
        }),
    }
}

/// A reason with the name of its gyro: the core knows gyros by their index only.
fn named(reason: &str, gyros: &[&str]) -> String {
    let found = gyros.iter().enumerate().find_map(|(index, name)| {
        let numbered = format!("gyro {index} ");
        reason.contains(&numbered).then(|| reason.replacen(&numbered, &format!("gyro {name} "), 1))
    });
    found.unwrap_or_else(|| reason.to_owned())
}

fn names(document: &document::Document) -> impl Iterator<Item = &str> {
    document.gyro.sensor.iter().map(|sensor| sensor.name.as_str())
}

/// Mean over the good time of all modes.
fn mean_temperature_deg_c(found: &GyroConstants) -> f64 {
    let each = [&found.modes.without, &found.modes.plus, &found.modes.minus];
    let seen = each.iter().filter_map(|mode| Some((mode.mean_temperature_deg_c? * mode.time_s, mode.time_s)));
    let (sum, time_s) = seen.fold((0.0, 0.0), |(sum, time_s), (s, t)| (sum + s, time_s + t));
    if time_s > 0.0 { sum / time_s } else { 0.0 }
}

/// The present time.
fn now() -> Option<Created> {
    Created::new(WallTime::from(SystemTime::now()).to_string().parse().ok()?)
}
