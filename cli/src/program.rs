//! What every program has for its packages: completions and manual pages, made from its command line.

use std::io;
use std::path::PathBuf;

use clap::{Command, CommandFactory, Subcommand};
use clap_complete::Shell;

use crate::exit::Exit;
use crate::print::print;
use crate::stderr::failed;

/// Commands of every program.
#[derive(Debug, Subcommand)]
pub enum Common {
    /// Print the completions of a shell
    Completions {
        /// The shell
        shell: Shell,
    },
    /// Write manual pages, one for each command
    Man {
        /// Folder for them; it must be there
        #[arg(long, value_name = "FOLDER")]
        out: PathBuf,
    },
}

impl Common {
    /// Does it for the program `P`.
    #[must_use]
    pub fn run<P: CommandFactory>(&self) -> Exit {
        match self.made::<P>() {
            Ok(printed) => print(&String::from_utf8_lossy(&printed), Exit::Ok),
            Err((folder, error)) => {
                let folder = folder.display();
                failed(format_args!("cannot write manual pages into {folder}: {error}"), Exit::Failed)
            }
        }
    }

    /// What is to be printed; or the folder that pages cannot be written into.
    fn made<P: CommandFactory>(&self) -> Result<Vec<u8>, (PathBuf, io::Error)> {
        let mut command = P::command();
        let mut printed = Vec::new();
        match self {
            Self::Completions { shell } => {
                let name = command.get_name().to_owned();
                clap_complete::generate(*shell, &mut command, &name, &mut printed);
                if *shell == Shell::Bash {
                    // It spells the hyphen of a program's name in two ways (clap_complete 4.6).
                    let script = String::from_utf8_lossy(&printed);
                    let one_way = script.replace(&name.replace('-', "__subcmd__"), &name.replace('-', "__"));
                    printed = one_way.into_bytes();
                }
            }
            Self::Man { out } => {
                clap_mangen::generate_to(for_pages(command), out).map_err(|error| (out.clone(), error))?;
            }
        }
        Ok(printed)
    }
}

/// Has every command show the version, which its page names, and describe its rare options there too.
fn for_pages(command: Command) -> Command {
    let whole = |sub: Command| for_pages(sub.version(env!("CARGO_PKG_VERSION")).disable_version_flag(true));
    command.mut_args(|arg| arg.hide_short_help(false)).mut_subcommands(whole)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    #[command(name = "program", version)]
    struct Cli {
        #[command(subcommand)]
        command: Sub,
    }

    #[derive(Debug, Subcommand)]
    enum Sub {
        /// Does something
        Act {
            /// How rarely
            #[arg(long, hide_short_help = true)]
            rarely: bool,
        },
        #[command(flatten)]
        Common(Common),
    }

    fn run(arguments: &[&str]) -> Result<Vec<u8>, (PathBuf, io::Error)> {
        match Cli::try_parse_from(arguments).unwrap().command {
            Sub::Common(common) => common.made::<Cli>(),
            Sub::Act { .. } => unreachable!(),
        }
    }

    #[test]
    fn every_command_has_a_page_with_all_its_options() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().to_str().unwrap();
        assert!(run(&["program", "man", "--out", path]).unwrap().is_empty());
        let mut pages: Vec<_> =
            std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        pages.sort();
        assert_eq!(pages, ["program-act.1", "program-completions.1", "program-man.1", "program.1"]);
        let page = std::fs::read_to_string(folder.path().join("program-act.1")).unwrap();
        assert!(page.contains("How rarely") && page.contains(env!("CARGO_PKG_VERSION")), "{page}");
        let (folder, error) = run(&["program", "man", "--out", "/no/such/folder"]).unwrap_err();
        assert_eq!((folder.to_str(), error.kind()), (Some("/no/such/folder"), io::ErrorKind::NotFound));
    }

    #[derive(Debug, Parser)]
    #[command(name = "two-words", version)]
    struct TwoWords {
        #[command(subcommand)]
        command: Common,
    }

    /// What the script calls a command, and the cases in which it completes one.
    #[test]
    fn bash_completes_every_command_that_it_recognises() {
        let completions = Common::Completions { shell: Shell::Bash };
        for (script, commands) in [(completions.made::<Cli>(), 4), (completions.made::<TwoWords>(), 3)] {
            let script = String::from_utf8(script.unwrap()).unwrap();
            let names: Vec<_> =
                script.lines().filter_map(|line| line.trim().strip_prefix("cmd=\"")).collect();
            let names: Vec<_> =
                names.iter().map(|name| name.trim_end_matches('"')).filter(|n| !n.is_empty()).collect();
            assert!(names.len() >= commands, "{script}");
            for name in names {
                assert!(script.contains(&format!("\n        {name})")), "{name}:\n{script}");
            }
        }
    }
}
