//! I4 at work: every broken document is refused with file, line and key, whichever way it comes in, and the stream does
//! not notice.

mod bytes;
mod odd;
mod others;
mod relations;
mod values;

use std::path::{Path, PathBuf};

use isotherm_bus::ProducerOptions;
use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{MAX_DOCUMENT_BYTES, Problem};
use isotherm_protocol::history::{AuditEvent, Refusal, Source};
use isotherm_service::Settings;
use isotherm_simulator::presets::zeeman_sine;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::operator::audit;
use isotherm_tests::player::Player;

use crate::documents::{BASE, BASE_UNIT};
use crate::stand::{Folders, Stand};

/// A document that is broken in one place: name, text to replace (its first occurrence), replacement, text that stands
/// on the line of the problem after the edit, key, part of the message.
type Edit = (&'static str, &'static str, &'static str, &'static str, &'static str, &'static str);

/// Something to be refused.
struct Case {
    name: String,
    bytes: Vec<u8>,
    /// Line of the problem.
    line: usize,
    key: String,
    /// Part of the message.
    says: String,
}

impl Case {
    fn new(name: &str, bytes: impl Into<Vec<u8>>, line: usize, key: &str, says: &str) -> Self {
        Self { name: name.to_owned(), bytes: bytes.into(), line, key: key.to_owned(), says: says.to_owned() }
    }

    /// The shipped document, edited.
    fn edited((name, from, to, at, key, says): Edit) -> Self {
        assert!(BASE.contains(from), "{name}: {from:?} is not in the document");
        let text = BASE.replacen(from, to, 1);
        let line = line_of(&text, at);
        Self::new(name, text, line, key, says)
    }

    /// Whether one of the problems, each in words, is the one of this case.
    fn is_told(&self, file: &str, problems: &[String]) -> bool {
        let place = format!("{file}:{}:", self.line);
        let key = if self.key.is_empty() { String::new() } else { format!(": {}: ", self.key) };
        let told = |problem: &&String| {
            problem.starts_with(&place) && problem.contains(&key) && problem.contains(&self.says)
        };
        problems.iter().any(|problem| told(&problem))
    }

    fn expected(&self, file: &str) -> String {
        format!(
            "{}: no problem at {file}:{}, key {:?}, saying {:?}",
            self.name, self.line, self.key, self.says
        )
    }
}

/// Line of the first occurrence, from 1.
fn line_of(text: &str, part: &str) -> usize {
    let at = text.find(part).unwrap_or_else(|| panic!("{part:?} is not in the text"));
    text[..at].matches('\n').count() + 1
}

/// A service whose one unit is at play under a good document.
struct Scene {
    folders: Folders,
    stand: Stand,
    player: Player,
    played: u64,
    /// The document in force.
    revision: Revision,
    /// What was not as it must be.
    failures: Vec<String>,
}

impl Scene {
    /// Starts with a good document in the folder.
    async fn start(folders: Folders, settings: Settings, good: &str) -> Self {
        folders.put("good.toml", good.as_bytes());
        let stand = Stand::start(settings).await;
        let options = ProducerOptions { match_timeout: LIMIT, ..ProducerOptions::default() };
        let player = Player::declare(stand.operator.session(), &zeeman_sine(4), options).await;
        let revision = Revision { counter: 1, digest: Digest::of(good.as_bytes()).head() };
        let mut scene = Self { folders, stand, player, played: 0, revision, failures: Vec::new() };
        scene.goes_on("the start").await;
        scene
    }

    /// Plays a few ticks and sees each come back once, made by the good document.
    async fn goes_on(&mut self, behind: &str) {
        const TICKS: u64 = 4;
        self.player.play(TICKS).await;
        let end = self.played + TICKS;
        while self.played < end {
            let batch = tokio::time::timeout(LIMIT, self.stand.consumer.next()).await;
            let batch = batch.unwrap_or_else(|_| panic!("no output behind {behind}")).unwrap();
            assert_eq!(batch.revision, self.revision, "behind {behind}");
            for tick in batch.ticks {
                assert_eq!((tick.sequence, tick.missed), (self.played, 0), "behind {behind}");
                self.played += 1;
            }
        }
    }

    /// Has a case refused over the bus.
    async fn refuse_query(&mut self, case: &Case, options: &SwapOptions) {
        let reply = self.stand.operator.swap(BASE_UNIT, &case.bytes, options).await.unwrap();
        assert_eq!(reply.outcome, SwapOutcome::Refused, "{}", case.name);
        assert_eq!(reply.revision, self.revision.counter, "{}", case.name);
        let problems: Vec<_> = reply.problems.iter().map(Problem::to_string).collect();
        self.expect(case, &format!("imu/{BASE_UNIT}/calibration"), &problems);
        self.goes_on(&case.name).await;
    }

    /// Has a case refused as a new file of the folder.
    async fn refuse_file(&mut self, case: &Case, number: usize) {
        let file = self.folders.put(&format!("case-{number}.toml"), &case.bytes);
        self.see_refused(case, &file).await;
        std::fs::remove_file(&file).unwrap();
    }

    /// Has a case refused in the place of the document in force, and puts that one back.
    async fn refuse_in_place(&mut self, case: &Case, good: &str) {
        let file = self.folders.put("good.toml", &case.bytes);
        self.see_refused(case, &file).await;
        self.folders.put("good.toml", good.as_bytes());
        self.stand.operator.until_service(|status| status.bad_documents.is_empty().then_some(())).await;
    }

    async fn see_refused(&mut self, case: &Case, file: &Path) {
        self.until_bad(file, &case.name).await;
        let digest = Digest::of(&case.bytes[..case.bytes.len().min(MAX_DOCUMENT_BYTES + 1)]);
        let of_file = |refusal: &&Refusal| {
            let from = matches!(&refusal.source, Source::Folder { path } if Path::new(path) == file);
            from && refusal.digest == digest
        };
        match refusals(&self.folders.state).iter().find(of_file) {
            Some(refusal) => self.expect(case, file.to_str().unwrap(), &refusal.problems),
            None => self.failures.push(format!("{}: no entry in the audit file", case.name)),
        }
        self.goes_on(&case.name).await;
    }

    fn expect(&mut self, case: &Case, file: &str, problems: &[String]) {
        if !case.is_told(file, problems) {
            self.failures.push(format!(
                "{} in {:#?}",
                case.expected(file),
                problems.get(..4).unwrap_or(problems)
            ));
        }
    }

    /// Waits until the service says that a file of the folder is bad; what it says.
    async fn until_bad(&self, file: &Path, name: &str) -> String {
        let file = file.to_str().unwrap();
        let deadline = tokio::time::Instant::now() + LIMIT;
        loop {
            let status = self.stand.operator.service().await;
            if let Some(bad) = status.bad_documents.iter().find(|bad| bad.file == file) {
                return bad.problem.clone();
            }
            assert!(tokio::time::Instant::now() < deadline, "{name} is not told: {status:#?}");
            tokio::time::sleep(std::time::Duration::from_millis(3)).await;
        }
    }

    /// Nothing but the good document was ever accepted, and no tick is missing.
    async fn end(mut self) {
        assert!(self.failures.is_empty(), "{}", self.failures.join("\n"));
        self.goes_on("everything").await;
        let status = self.stand.operator.status(BASE_UNIT).await;
        assert_eq!(status.revision(), self.revision);
        for counter in ["gaps", "ticks_missed", "duplicates", "bad_frames"] {
            assert_eq!(status.counter(counter), 0, "{counter}");
        }
        let account =
            self.stand.consumer.continuity(&isotherm_protocol::key::UnitId::new(BASE_UNIT).unwrap());
        assert!(account.is_whole() && account.ticks == self.played, "{account:?}");
        Box::pin(self.stand.stop()).await;
        let entries = audit(&self.folders.state);
        let accepted = entries.iter().filter(|entry| matches!(entry.event, AuditEvent::Accepted(_)));
        assert_eq!(accepted.count(), 1);
    }
}

/// Refusals that were written down.
fn refusals(state: &Path) -> Vec<Refusal> {
    let refused = audit(state).into_iter().filter_map(|entry| match entry.event {
        AuditEvent::Refused(refusal) => Some(refusal),
        _ => None,
    });
    refused.collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn every_broken_document_is_refused_with_file_line_and_key_and_the_stream_does_not_notice() {
    let folders = Folders::new();
    let settings = folders.settings();
    let mut scene = Scene::start(folders, settings, BASE).await;
    let mut cases: Vec<_> = values::EDITS.into_iter().chain(relations::EDITS).map(Case::edited).collect();
    cases.extend(bytes::cases());
    for (number, case) in cases.iter().enumerate() {
        scene.refuse_query(case, &SwapOptions::default()).await;
        scene.refuse_file(case, number).await;
    }
    let over_the_bus = others::over_the_bus();
    for case in &over_the_bus {
        // Neither is a matter of taste.
        let force = SwapOptions { force: true, ..SwapOptions::default() };
        scene.refuse_query(case, &force).await;
    }
    let odd = odd::cases();
    for case in &odd {
        scene.refuse_odd(case).await;
    }
    scene.refuse_rivals().await;
    assert!(cases.len() + over_the_bus.len() + odd.len() >= 80, "{} documents", cases.len());
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_signed_as_it_must_be_is_refused_and_the_stream_does_not_notice() {
    let folders = Folders::new();
    let mut settings = folders.settings();
    settings.swap.require_signature = true;
    settings.swap.trusted_keys = Some(others::trust(&folders.beside("trusted")));
    let good = others::signed();
    let mut scene = Scene::start(folders, settings, &good).await;
    for case in others::badly_signed() {
        let force = SwapOptions { force: true, ..SwapOptions::default() };
        scene.refuse_query(&case, &force).await;
        scene.refuse_in_place(&case, &good).await;
    }
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_full_of_what_is_no_document_keeps_no_service_from_starting() {
    let folders = Folders::new();
    let odd = odd::cases();
    let made: Vec<(PathBuf, _)> = odd.iter().map(|case| (case.make(&folders), case)).collect();
    let settings = folders.settings();
    let scene = Scene::start(folders, settings, BASE).await;
    for (file, case) in made.iter().filter(|(_, case)| case.is_told_at_start()) {
        let told = scene.until_bad(file, case.name).await;
        assert!(told.contains(case.says), "{}: {told}", case.name);
    }
    for (file, case) in &made {
        case.remove(file);
    }
    scene.end().await;
}
