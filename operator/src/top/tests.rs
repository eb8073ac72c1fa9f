use std::time::{Duration, Instant};

use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};

use super::draw::draw;
use super::feed::News;
use super::fleet::Fleet;
use super::order::Sort;
use super::view::{Act, Shown, View};
use crate::page::tests::samples::{self, NOW_UNIX_MS};

/// A fleet, a view and a terminal of a size, with a clock that is set by hand.
struct Bench {
    fleet: Fleet,
    view: View,
    terminal: Terminal<TestBackend>,
    now: Instant,
    unix_ms: i64,
}

impl Bench {
    fn new(units: Vec<Status>, columns: u16, rows: u16) -> Self {
        let terminal = Terminal::new(TestBackend::new(columns, rows)).unwrap();
        let (fleet, view) = (Fleet::default(), View::default());
        let mut bench = Self { fleet, view, terminal, now: Instant::now(), unix_ms: NOW_UNIX_MS };
        bench.take(News::Service(Box::new(samples::service(&units))));
        for status in units {
            bench.take(News::Unit(Box::new(status)));
        }
        bench
    }

    fn take(&mut self, news: News) {
        self.fleet.take(news, self.now, self.unix_ms);
    }

    fn pass(&mut self, seconds: u64) {
        self.now += Duration::from_secs(seconds);
        self.unix_ms += 1000 * i64::try_from(seconds).unwrap();
    }

    fn press(&mut self, codes: impl IntoIterator<Item = KeyCode>) -> Act {
        let mut act = Act::Nothing;
        for code in codes {
            self.screen();
            act = self.view.take(&Event::Key(KeyEvent::new(code, KeyModifiers::NONE)));
        }
        act
    }

    fn type_in(&mut self, words: &str) {
        self.press(words.chars().map(KeyCode::Char));
    }

    /// The screen as text, a line for each row.
    fn screen(&mut self) -> String {
        let Self { fleet, view, terminal, now, unix_ms } = self;
        fleet.forget(*now);
        let drawn = terminal.draw(|frame| draw(frame, fleet, view, *now, *unix_ms)).unwrap();
        let buffer = drawn.buffer.clone();
        let rows = buffer.content.chunks(usize::from(buffer.area.width));
        let row = |cells: &[ratatui::buffer::Cell]| {
            let text: String = cells.iter().map(ratatui::buffer::Cell::symbol).collect();
            text.trim_end().to_owned() + "\n"
        };
        rows.map(row).collect()
    }

    fn line_of(&mut self, serial: &str) -> String {
        let screen = self.screen();
        let line = screen.lines().find(|line| line.contains(serial));
        line.unwrap_or_else(|| panic!("{serial} in\n{screen}")).to_owned()
    }
}

#[test]
fn every_size_of_terminal_and_fleet_is_drawn() {
    for count in [0, 1, 8, 200] {
        for (columns, rows) in [(1, 1), (3, 2), (20, 5), (80, 24), (120, 40), (160, 50), (300, 100)] {
            let mut bench = Bench::new(samples::fleet(count), columns, rows);
            for code in [KeyCode::Down, KeyCode::End, KeyCode::Enter, KeyCode::End, KeyCode::Char('?')] {
                bench.press([code]);
            }
            bench.screen();
        }
    }
}

#[test]
fn the_first_screen_has_services_tally_units_and_keys() {
    let screens = [8, 0].map(|units| Bench::new(samples::fleet(units), 80, 24).screen());
    insta::assert_snapshot!(screens.concat());
}

#[test]
fn the_selection_scrolls_through_two_hundred_units_and_never_beyond() {
    let mut bench = Bench::new(samples::fleet(200), 80, 24);
    bench.type_in("s");
    // The last line says which rows are shown, and of how many.
    let mut told = Vec::new();
    let mut look = |bench: &mut Bench| told.push(bench.line_of(" of 200"));
    look(&mut bench);
    bench.press([KeyCode::Up]);
    assert_eq!(bench.view.selected_at(), Some(0));
    bench.press([KeyCode::PageDown, KeyCode::Down]);
    assert_eq!(bench.view.selected_at(), Some(18));
    look(&mut bench);
    bench.press([KeyCode::End, KeyCode::Down]);
    look(&mut bench);
    assert!(bench.line_of("ZLG-0200").contains("ZLG-0200"));
    bench.press([KeyCode::Home]);
    look(&mut bench);
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn of_two_hundred_units_the_first_screen_shows_those_that_are_worst() {
    let mut bench = Bench::new(samples::fleet(200), 80, 24);
    let screen = bench.screen();
    let table = screen.lines().skip_while(|line| !line.contains("state"));
    let units: Vec<_> = table.filter(|line| line.contains("ZLG-")).collect();
    assert!(
        !units.is_empty() && units.iter().all(|line| line.contains('!') || line.contains('▲')),
        "{screen}"
    );
}

#[test]
fn the_selected_unit_stays_selected_wherever_its_numbers_move_it() {
    let mut bench = Bench::new(samples::fleet(8), 120, 24);
    bench.type_in("ss");
    bench.screen();
    assert_eq!((bench.view.sort, bench.view.selected_at()), (Sort::Temperature, Some(0)));
    bench.press([KeyCode::Down; 2]);
    let selected = bench.view.selected.clone().unwrap();
    let mut status = samples::running(&selected.0);
    status.channels[0].temperature_deg_c = Some(80.0);
    bench.take(News::Unit(Box::new(status)));
    bench.screen();
    assert_eq!((bench.view.selected.as_ref(), bench.view.selected_at()), (Some(&selected), Some(0)));
    // Who sorts anew wants to see what comes first.
    bench.type_in("r");
    bench.screen();
    assert_eq!(bench.view.selected_at(), Some(0));
    assert_ne!(bench.view.selected.as_ref(), Some(&selected));
    insta::assert_snapshot!(bench.screen());
}

#[test]
fn each_order_puts_first_what_it_says() {
    let mut bench = Bench::new(samples::fleet(25), 120, 40);
    for (sort, first) in [
        (Sort::Serial, "ZLG-0001"),
        (Sort::Temperature, "ZLG-0004"),
        (Sort::Latency, "ZLG-0020"),
        (Sort::Gaps, "ZLG-0005"),
        (Sort::State, "ZLG-0005"),
    ] {
        bench.type_in("s");
        let screen = bench.screen();
        assert_eq!(bench.view.sort, sort);
        let table = screen.lines().skip_while(|line| !line.contains("state")).nth(1).unwrap();
        assert!(table.contains(first), "{sort:?}\n{screen}");
    }
    bench.type_in("S");
    assert_eq!(bench.view.sort, Sort::Gaps);
}

#[test]
fn a_filter_looks_at_serial_state_and_note_and_ends_with_escape() {
    let mut bench = Bench::new(samples::fleet(25), 120, 40);
    for (filter, kept) in [("0012", 1), ("STANDBY", 1), ("no calibration", 1), ("zlg", 25), ("no such", 0)] {
        bench.type_in("/");
        bench.type_in(filter);
        let screen = bench.screen();
        assert_eq!(bench.view.order.len(), kept, "{filter}\n{screen}");
        assert!(screen.contains(&format!("/{filter}")), "{screen}");
        bench.press([KeyCode::Enter]);
        assert!(bench.screen().contains(&format!("filter: {filter}")));
        bench.press([KeyCode::Esc]);
    }
    bench.type_in("/q");
    assert_eq!(bench.press([KeyCode::Backspace, KeyCode::Enter]), Act::Draw);
    bench.screen();
    assert_eq!(bench.view.order.len(), 25);
}

#[test]
fn the_page_of_a_unit_scrolls_turns_and_goes_back() {
    let mut bench = Bench::new(samples::fleet(8), 80, 24);
    bench.type_in("s");
    bench.press([KeyCode::Down; 4]);
    bench.press([KeyCode::Enter]);
    let mut screens = vec![bench.screen()];
    for key in [KeyCode::End, KeyCode::Right, KeyCode::Char('?')] {
        bench.press([key]);
        screens.push(bench.screen());
    }
    insta::assert_snapshot!(screens.concat());
    bench.press([KeyCode::Esc]);
    assert_eq!(bench.view.shown, Shown::Page);
    bench.press([KeyCode::Esc]);
    assert_eq!((bench.view.shown, bench.view.selected_at()), (Shown::Table, Some(5)));
}

#[test]
fn only_q_and_control_c_quit() {
    let mut bench = Bench::new(samples::fleet(1), 80, 24);
    for code in [KeyCode::Esc, KeyCode::Enter, KeyCode::Esc, KeyCode::Char('x'), KeyCode::F(1)] {
        assert_ne!(bench.press([code]), Act::Quit);
    }
    assert_eq!(bench.press([KeyCode::Char('q')]), Act::Quit);
    let control_c = Event::Key(KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL));
    bench.press([KeyCode::Char('/')]);
    assert_eq!(bench.view.take(&control_c), Act::Quit);
}

#[test]
fn a_unit_that_vanishes_is_grey_with_its_age_until_it_comes_back() {
    let mut bench = Bench::new(samples::fleet(8), 120, 24);
    bench.take(News::UnitAlive("ZLG-0001".to_owned(), false));
    // Had been on its way.
    bench.take(News::Unit(Box::new(samples::running("ZLG-0001"))));
    bench.pass(75);
    insta::assert_snapshot!(bench.screen());
    bench.take(News::UnitAlive("ZLG-0001".to_owned(), true));
    bench.take(News::Unit(Box::new(samples::running("ZLG-0001"))));
    assert!(bench.line_of("ZLG-0001").starts_with('●'));
}

#[test]
fn a_service_that_dies_takes_its_units_along_and_the_next_one_takes_them_over() {
    let mut bench = Bench::new(samples::fleet(8), 120, 24);
    bench.take(News::ServiceAlive(samples::INSTANCE.to_owned(), false));
    bench.pass(3);
    let mut screens = vec![bench.screen()];
    let another = "another".to_owned();
    let service = samples::service(&samples::fleet(7));
    bench.take(News::Service(Box::new(ServiceStatus { instance: another.clone(), ..service })));
    for mut status in samples::fleet(7) {
        // The token does not say whose it is.
        bench.take(News::UnitAlive(status.unit.clone(), true));
        status.instance.clone_from(&another);
        bench.take(News::Unit(Box::new(status)));
    }
    screens.push(bench.screen());
    // Once it has them all there is nothing to tell of the one before.
    let last = Status { instance: another, ..samples::running("ZLG-0008") };
    bench.take(News::Unit(Box::new(last)));
    screens.push(bench.screen());
    insta::assert_snapshot!(screens.concat());
}

#[test]
fn two_services_that_have_one_unit_are_both_shown() {
    let mut bench = Bench::new(samples::fleet(1), 120, 24);
    let second = Status { instance: "another".to_owned(), ..samples::running("ZLG-0001") };
    bench.take(News::Unit(Box::new(second)));
    assert_eq!(bench.screen().matches("ZLG-0001").count(), 2);
    bench.take(News::ServiceAlive("another".to_owned(), false));
    assert_eq!(bench.screen().matches("ZLG-0001").count(), 1);
    assert!(bench.line_of("ZLG-0001").starts_with('●'));
}

#[test]
fn what_is_silent_for_long_is_gone_whatever_its_token_says() {
    let mut bench = Bench::new(samples::fleet(1), 120, 24);
    let lines = [30, 150].map(|seconds| {
        bench.pass(seconds);
        bench.line_of("ZLG-0001")
    });
    insta::assert_snapshot!(lines.join("\n"));
    bench.fleet.take(News::UnitAlive("ZLG-0001".to_owned(), false), bench.now, bench.unix_ms);
    bench.pass(24 * 3600);
    bench.screen();
    assert!(bench.view.order.is_empty());
}

#[test]
fn counters_that_grow_are_noticed_for_a_minute() {
    let mut bench = Bench::new(vec![samples::running("ZLG-0001")], 200, 24);
    let mut status = samples::running("ZLG-0001");
    let gaps = |status: &mut Status, gaps| {
        status.counters.iter_mut().filter(|c| c.name == "gaps").for_each(|c| c.value = gaps);
    };
    gaps(&mut status, 2);
    bench.pass(1);
    bench.take(News::Unit(Box::new(status.clone())));
    insta::assert_snapshot!(bench.line_of("ZLG-0001"));
    for _ in 0..61 {
        bench.pass(1);
        bench.take(News::Unit(Box::new(status.clone())));
    }
    assert!(bench.line_of("ZLG-0001").starts_with('●'));
}

#[test]
fn a_unit_that_takes_ticks_and_gives_none_is_a_fault() {
    let mut bench = Bench::new(vec![samples::running("ZLG-0001")], 200, 24);
    let mut status = samples::running("ZLG-0001");
    for _ in 0..11 {
        bench.pass(1);
        status.counters.iter_mut().filter(|c| c.name == "gyro_ticks_in").for_each(|c| c.value += 200);
        bench.take(News::Unit(Box::new(status.clone())));
    }
    insta::assert_snapshot!(bench.line_of("ZLG-0001"));
    // The first tick that goes out ends it.
    bench.pass(1);
    status.counters.iter_mut().filter(|c| c.name == "ticks_out").for_each(|c| c.value += 200);
    bench.take(News::Unit(Box::new(status)));
    assert!(bench.line_of("ZLG-0001").starts_with('●'));
}

#[test]
fn a_status_of_another_version_is_told_of() {
    let mut bench = Bench::new(samples::fleet(1), 120, 24);
    bench.take(News::NotUnderstood);
    insta::assert_snapshot!(bench.screen());
}

/// `cargo test … -- --ignored screens`: writes what operators see to files, to be looked at.
#[test]
#[ignore = "writes files to be looked at"]
fn screens_of_top() {
    let folder = std::env::var("ISOTHERM_SCREENS").unwrap_or_else(|_| "../target/screens".to_owned());
    std::fs::create_dir_all(&folder).unwrap();
    for (columns, rows) in [(80, 24), (120, 40), (160, 50)] {
        for count in [1, 8, 200] {
            let mut bench = Bench::new(samples::fleet(count), columns, rows);
            for _ in 0..120 {
                bench.pass(1);
                for mut status in samples::fleet(count) {
                    let rise = f64::from(u32::try_from(bench.unix_ms - NOW_UNIX_MS).unwrap()) / 1e5;
                    let warm = |t: Option<f64>| t.map(|t| t + rise.sin());
                    status.channels.iter_mut().for_each(|c| c.temperature_deg_c = warm(c.temperature_deg_c));
                    bench.take(News::Unit(Box::new(status)));
                }
            }
            bench.take(News::UnitAlive("ZLG-0002".to_owned(), false));
            let write = |name: &str, bench: &mut Bench| {
                let file = format!("{folder}/top-{count}-units-{columns}x{rows}-{name}.txt");
                std::fs::write(file, bench.screen()).unwrap();
            };
            write("1-table", &mut bench);
            bench.type_in("s");
            write("2-by-state", &mut bench);
            bench.press([KeyCode::Enter]);
            write("3-page", &mut bench);
            bench.press([KeyCode::End]);
            write("4-page-end", &mut bench);
            bench.type_in("?");
            write("5-help", &mut bench);
        }
    }
}
