//! What the operator looks at: changed by keys, and nothing else.

use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::widgets::TableState;

use super::fleet::Key;
use super::order::Sort;

/// Longest filter.
const LONGEST_FILTER: usize = 64;

/// What is to be done after a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Act {
    /// Nothing has changed.
    Nothing,
    /// Draw.
    Draw,
    /// Wipe the screen, then draw.
    Clear,
    /// End.
    Quit,
}

/// What is on the screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Shown {
    /// The table.
    #[default]
    Table,
    /// Everything of the selected unit.
    Page,
    /// The keys and what the columns mean.
    Help,
}

/// What the operator looks at.
#[derive(Debug, Default)]
pub(super) struct View {
    pub(super) shown: Shown,
    pub(super) sort: Sort,
    pub(super) reversed: bool,
    pub(super) filter: String,
    /// The filter is being typed.
    pub(super) typing: bool,
    /// The selected unit: it stays selected wherever its numbers move it to.
    pub(super) selected: Option<Key>,
    /// Which line of the table is selected, and which is the first to be seen.
    pub(super) table: TableState,
    /// First line of the page, or of the help, that is shown.
    pub(super) page_first: usize,
    /// What the help was called from.
    before_help: Shown,
    /// The units in the order in which they were drawn last.
    pub(super) order: Vec<Key>,
    /// How many lines of them were to be seen.
    pub(super) height: usize,
}

impl View {
    /// Takes a key or a change of size.
    pub(super) fn take(&mut self, event: &Event) -> Act {
        match event {
            Event::Key(key) if key.kind != KeyEventKind::Release => self.key(*key),
            Event::Resize(..) => Act::Draw,
            _ => Act::Nothing,
        }
    }

    fn key(&mut self, key: KeyEvent) -> Act {
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return match key.code {
                KeyCode::Char('c') => Act::Quit,
                KeyCode::Char('l') => Act::Clear,
                _ => Act::Nothing,
            };
        }
        if self.typing {
            return self.type_filter(key.code);
        }
        match (self.shown, key.code) {
            (_, KeyCode::Char('q')) => return Act::Quit,
            (Shown::Help, KeyCode::Char('?' | 'h') | KeyCode::Esc | KeyCode::Enter | KeyCode::Backspace) => {
                self.show(self.before_help);
            }
            (_, KeyCode::Char('?' | 'h')) => {
                self.before_help = self.shown;
                self.show(Shown::Help);
            }
            (Shown::Page, KeyCode::Esc | KeyCode::Enter | KeyCode::Backspace) => self.show(Shown::Table),
            (Shown::Page, KeyCode::Left | KeyCode::Char('p')) => self.turn(-1),
            (Shown::Page, KeyCode::Right | KeyCode::Char('n')) => self.turn(1),
            (Shown::Page | Shown::Help, code) => return self.scroll(code),
            (Shown::Table, code) => return self.table_key(code),
        }
        Act::Draw
    }

    /// How many lines a key goes down.
    fn motion(&self, code: KeyCode) -> Option<isize> {
        let page = isize::try_from(self.height.max(2) - 1).unwrap_or(1);
        Some(match code {
            KeyCode::Up | KeyCode::Char('k') => -1,
            KeyCode::Down | KeyCode::Char('j') => 1,
            KeyCode::PageUp => -page,
            KeyCode::PageDown | KeyCode::Char(' ') => page,
            KeyCode::Home | KeyCode::Char('g') => isize::MIN,
            KeyCode::End | KeyCode::Char('G') => isize::MAX,
            _ => return None,
        })
    }

    fn table_key(&mut self, code: KeyCode) -> Act {
        if let Some(by) = self.motion(code) {
            self.select(by);
            return Act::Draw;
        }
        match code {
            KeyCode::Enter if self.selected.is_some() => self.show(Shown::Page),
            KeyCode::Char('s') => self.sort_by(self.sort.next(), false),
            KeyCode::Char('S') => self.sort_by(self.sort.previous(), false),
            KeyCode::Char('r') => self.sort_by(self.sort, !self.reversed),
            KeyCode::Char('/') => self.typing = true,
            KeyCode::Esc => self.filter.clear(),
            _ => return Act::Nothing,
        }
        Act::Draw
    }

    /// Who sorts wants to see what comes first.
    fn sort_by(&mut self, sort: Sort, reversed: bool) {
        (self.sort, self.reversed, self.selected) = (sort, reversed, None);
        self.order.clear();
    }

    fn type_filter(&mut self, code: KeyCode) -> Act {
        match code {
            KeyCode::Enter => self.typing = false,
            KeyCode::Esc => {
                self.typing = false;
                self.filter.clear();
            }
            KeyCode::Backspace => drop(self.filter.pop()),
            KeyCode::Char(c) if self.filter.chars().count() < LONGEST_FILTER => self.filter.push(c),
            KeyCode::Up => self.select(-1),
            KeyCode::Down => self.select(1),
            _ => return Act::Nothing,
        }
        Act::Draw
    }

    fn scroll(&mut self, code: KeyCode) -> Act {
        let Some(by) = self.motion(code) else { return Act::Nothing };
        // What draws it knows where its end is.
        self.page_first = self.page_first.saturating_add_signed(by);
        Act::Draw
    }

    fn show(&mut self, shown: Shown) {
        self.shown = shown;
        self.page_first = 0;
    }

    /// The page of the unit before or after, in the order of the table.
    fn turn(&mut self, by: isize) {
        self.select(by);
        self.page_first = 0;
    }

    /// Moves the selection, at most to the ends of the table.
    fn select(&mut self, by: isize) {
        let at = self.selected_at().unwrap_or(0);
        let last = self.order.len().saturating_sub(1);
        self.selected = self.order.get(at.saturating_add_signed(by).min(last)).cloned();
    }

    /// Where the selected unit stands.
    pub(super) fn selected_at(&self) -> Option<usize> {
        let selected = self.selected.as_ref()?;
        self.order.iter().position(|key| key == selected)
    }

    /// Takes the order in which units are about to be drawn in so many lines: the selected one must be among them.
    pub(super) fn arrange(&mut self, order: Vec<Key>, height: usize) {
        let before = self.selected_at().unwrap_or(0);
        (self.order, self.height) = (order, height);
        if self.selected_at().is_none() {
            // The one that stands there now: the selected one is filtered out, or was forgotten.
            self.selected = self.order.get(before).or_else(|| self.order.last()).cloned();
        }
        self.table.select(self.selected_at());
        let lowest = self.order.len().saturating_sub(height);
        *self.table.offset_mut() = self.table.offset().min(lowest);
    }
}
