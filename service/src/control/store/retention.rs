//! What of the state folder may go: old audit files, and documents that nothing can go back to.

use std::collections::BTreeSet;
use std::time::{Duration, SystemTime};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::overlay::base_of;

use super::log::full_files;
use super::{Journal, Store};

/// Full audit files that are kept: a gibibyte.
pub(super) const KEPT_FILES: usize = 16;
/// How long a document is kept that no revision names any more which can be gone back to.
const KEPT: Duration = Duration::from_secs(90 * 86_400);

impl Store {
    /// Takes away what may go, after the start and whenever a new audit file was begun. To be called where nothing waits to be
    /// written down: a document is stored before the line that names it.
    pub(super) fn prune_if_due(&mut self, now: SystemTime) {
        let Journal::Folder { path, .. } = &self.journal else { return };
        if !std::mem::take(&mut self.prune_due) {
            return;
        }
        let files = full_files(path).unwrap_or_default();
        let old_files = files.iter().take(files.len().saturating_sub(KEPT_FILES));
        let removed = old_files.filter(|file| std::fs::remove_file(file).is_ok()).count();
        if removed > 0 {
            tracing::info!(removed, "the oldest audit files are removed: {KEPT_FILES} are kept");
        }
        // Where lines were lost, one of them may have named what now seems to be named by none.
        if self.is_damaged {
            return;
        }
        let named: BTreeSet<Digest> = self.index.digests().collect();
        let bases: BTreeSet<Digest> =
            named.iter().filter_map(|digest| base_of(&self.overlays.get(digest).ok()??)).collect();
        let unnamed = |digest: &Digest| !named.contains(digest) && !bases.contains(digest);
        let removed =
            [&self.documents, &self.overlays].map(|blobs| blobs.prune(now, KEPT, unnamed)).iter().sum();
        if let 1_usize.. = removed {
            tracing::info!(removed, "documents that no rollback can reach are removed");
        }
    }
}
