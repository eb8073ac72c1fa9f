//! What the manager of a service sees: when it is ready, that it is alive although nobody sends, that it is not where a receive
//! thread hangs, and that it stops.

use std::io::{self, Write};
use std::os::unix::net::UnixDatagram;
use std::process::{Child, Command, Stdio};
use std::sync::{Condvar, Mutex};
use std::time::{Duration, Instant};

use isotherm_bus::{close, open};
use isotherm_protocol::key::UnitId;
use isotherm_service::Stuck;
use isotherm_tests::bench::{Bench, LIMIT};
use isotherm_tests::process::{program, send_signal};
use isotherm_tests::streams::send_waiting_ticks;

/// A service whose manager the test is.
struct Managed {
    child: Child,
    socket: UnixDatagram,
    _folder: tempfile::TempDir,
}

impl Managed {
    fn start(watchdog: Duration) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let address = folder.path().join("notify");
        let socket = UnixDatagram::bind(&address).unwrap();
        socket.set_read_timeout(Some(LIMIT)).unwrap();
        let child = Command::new(program("isotherm"))
            .args(["serve", "--listen", "127.0.0.1:0", "--log-level", "error"])
            .env("NOTIFY_SOCKET", &address)
            .env("WATCHDOG_USEC", watchdog.as_micros().to_string())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        Self { child, socket, _folder: folder }
    }

    /// The next that it is told, line by line.
    fn told(&self) -> Vec<String> {
        let mut buffer = [0; 4096];
        let length = self.socket.recv(&mut buffer).expect("told in time");
        String::from_utf8_lossy(&buffer[..length]).lines().map(str::to_owned).collect()
    }

    /// Everything told until this line comes, and with it.
    fn until(&self, line: &str) -> Vec<String> {
        let mut all = Vec::new();
        while !all.iter().any(|told| told == line) {
            all.extend(self.told());
        }
        all
    }
}

impl Drop for Managed {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_manager_is_told_of_start_and_end_and_an_idle_service_is_fed() {
    let watchdog = Duration::from_millis(400);
    let mut service = Managed::start(watchdog);
    let told = service.told();
    assert_eq!(told[0], "READY=1", "{told:?}");
    assert!(told[1].starts_with("STATUS=correcting, on tcp/127.0.0.1:"), "{told:?}");
    // Nobody sends, for longer than a hang takes to be noticed.
    let (start, mut fed) = (Instant::now(), 0);
    while start.elapsed() < Duration::from_secs(3) {
        let told = service.until("WATCHDOG=1");
        assert!(!told.iter().any(|line| line.contains("hangs")), "{told:?}");
        fed += 1;
    }
    // Thirty on a quiet machine.
    assert!(fed > 3, "{fed}");
    send_signal(&service.child, "TERM");
    service.until("STOPPING=1");
    assert_eq!(service.child.wait().unwrap().code(), Some(0));
}

/// A log that takes no line about one unit while the gate is closed: whoever writes one hangs.
#[derive(Clone, Copy)]
struct Gate;

const HANGING: &str = "HANGING-UNIT";
static CLOSED: Mutex<bool> = Mutex::new(false);
static OPENED: Condvar = Condvar::new();

impl Write for Gate {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        if String::from_utf8_lossy(line).contains(HANGING) {
            drop(OPENED.wait_while(CLOSED.lock().unwrap(), |closed| *closed).unwrap());
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_receive_thread_that_hangs_is_noticed_and_one_that_goes_on_again_too() {
    tracing_subscriber::fmt().with_writer(|| Gate).with_ansi(false).init();
    *CLOSED.lock().unwrap() = true;
    let mut bench = Bench::start_live(&[]).await;
    assert_eq!(bench.receives(), Ok(()));
    let session = open(&bench.options).await.unwrap();
    let unit = UnitId::new(HANGING).unwrap();
    // The line that tells of the unit's first message is written by the thread that has received it.
    send_waiting_ticks(&session, &unit, 50).await;
    let wait = |bench: &Bench, alive: bool| {
        let start = Instant::now();
        while bench.receives().is_ok() != alive {
            assert!(start.elapsed() < LIMIT, "alive: {alive}");
            std::thread::sleep(Duration::from_millis(20));
        }
        bench.receives()
    };
    assert!(matches!(wait(&bench, false), Err(Stuck::Message(since)) if since > Duration::from_secs(2)));
    *CLOSED.lock().unwrap() = false;
    OPENED.notify_all();
    assert_eq!(wait(&bench, true), Ok(()));
    assert_eq!(bench.receive(HANGING, 50).await.len(), 50, "nothing is lost that it had in hand");
    close(session, LIMIT).await.unwrap();
    bench.stop().await;
}
