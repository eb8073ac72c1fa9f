//! A shell that is given one block after the other.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use isotherm_tests::data::root;
use isotherm_tests::process::program;
use tempfile::TempDir;
use tokio::net::TcpSocket;

/// The longest that one block may take.
const BLOCK_LIMIT: Duration = Duration::from_secs(90);
/// Ends a block, in front of its exit code.
const END: &str = "@@ end of block: ";
/// Where the services of the page listen.
const ADDRESSES: [&str; 2] = ["127.0.0.1:7447", "127.0.0.1:9464"];
/// What the recipes need beside the project's programs and what every system has.
const TOOLS: [&str; 3] = ["bash", "curl", "prlimit"];
/// What the page calls the folder that it works in; as long as the name of a temporary one, so that tables keep their form.
const FOLDER: &str = "/home/ann/bench";

/// A bash in a folder of its own, with the project's programs on its path.
pub(super) struct Shell {
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<String>,
    folder: TempDir,
    /// Addresses that stand for those of the page.
    addresses: [String; 2],
    /// What keeps them from everybody else.
    _held: [TcpSocket; 2],
}

impl Shell {
    pub(super) fn start() -> Self {
        for tool in TOOLS {
            let there = Command::new(tool).arg("--version").stdout(Stdio::null()).status();
            assert!(there.is_ok_and(|status| status.success()), "the recipes need {tool}");
        }
        let folder = tempfile::tempdir().unwrap();
        let copied = Command::new("cp").arg("-r").arg(root().join("config")).arg(folder.path()).status();
        assert!(copied.is_ok_and(|status| status.success()), "config/ is copied");
        let programs = program("isotherm").parent().unwrap().to_owned();
        let path = std::env::var("PATH").unwrap_or_default();
        let mut child = Command::new("bash")
            .args(["--noprofile", "--norc"])
            .current_dir(folder.path())
            .env("PATH", format!("{}:{path}", programs.display()))
            .env("USER", "ann")
            .env("HOME", folder.path())
            .env("LC_ALL", "C.UTF-8")
            .env("no_proxy", "*")
            .env_remove("ISOTHERM_LOG")
            // A group of its own, so that what it leaves running can be ended with it.
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("bash starts");
        let stdin = child.stdin.take().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in lossy_lines(stdout) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        let held = [(); 2].map(|()| hold());
        let addresses = held.each_ref().map(|socket| socket.local_addr().unwrap().to_string());
        let mut shell = Self { child, stdin, lines, folder, addresses, _held: held };
        shell.run("exec 2>&1\n");
        shell
    }

    /// Runs a block, which must end well; what came out, in the words of the page.
    pub(super) fn run(&mut self, commands: &str) -> String {
        let mut block = commands.to_owned();
        for (of_page, here) in ADDRESSES.iter().zip(&self.addresses) {
            block = block.replace(of_page, here);
        }
        writeln!(self.stdin, "{block}\nprintf '{END}%s\\n' $?").unwrap();
        let mut came = String::new();
        loop {
            let line = self.lines.recv_timeout(BLOCK_LIMIT);
            let line = line.unwrap_or_else(|_| panic!("no end of\n{commands}\nwhat came:\n{came}"));
            if let Some((before, code)) = line.split_once(END) {
                came.push_str(before);
                assert_eq!(code, "0", "\n{commands}\nwhat came:\n{came}");
                break;
            }
            came.push_str(&line);
            came.push('\n');
        }
        for (of_page, here) in ADDRESSES.iter().zip(&self.addresses) {
            came = came.replace(here.as_str(), of_page);
        }
        came.replace(self.folder.path().to_str().unwrap(), FOLDER)
    }

    /// Ends it; nothing that it started is left.
    #[expect(clippy::unused_self, reason = "it is its end that counts")]
    pub(super) fn end(self) {}
}

impl Drop for Shell {
    fn drop(&mut self) {
        let group = format!("-{}", self.child.id());
        // Whatever is still there of the group, after a recipe that failed.
        let _ = Command::new("kill").args(["-9", "--", &group]).stderr(Stdio::null()).status();
        let _ = self.child.wait();
    }
}

/// A loopback address that is nobody else's: bound and never listened on, its port is given to none who asks the system for
/// one, while a service that names it may listen there, and again after a restart.
fn hold() -> TcpSocket {
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_reuseaddr(true).unwrap();
    socket.bind(([127, 0, 0, 1], 0).into()).unwrap();
    socket
}

/// Lines of whatever bytes come.
fn lossy_lines(mut reader: impl BufRead) -> impl Iterator<Item = String> {
    std::iter::from_fn(move || {
        let mut line = Vec::new();
        let count = (&mut reader).take(1 << 20).read_until(b'\n', &mut line).ok()?;
        let line = String::from_utf8_lossy(line.strip_suffix(b"\n").unwrap_or(&line)).into_owned();
        (count > 0).then_some(line)
    })
}
