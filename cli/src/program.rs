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
                clap_complete::generate(*shell, &mut command, name, &mut printed);
            }
            Self::Man { out } => {
                clap_mangen::generate_to(with_versions(command), out)
                    .map_err(|error| (out.clone(), error))?;
            }
        }
        Ok(printed)
    }
}

/// Has every command show the version, which its page names.
fn with_versions(command: Command) -> Command {
    let names: Vec<_> = command.get_subcommands().map(|sub| sub.get_name().to_owned()).collect();
    let with_version = |sub: Command| sub.version(env!("CARGO_PKG_VERSION")).disable_version_flag(true);
    names.into_iter().fold(command, |command, name| command.mut_subcommand(name, with_version))
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
        assert!(page.contains("rarely") && page.contains(env!("CARGO_PKG_VERSION")), "{page}");
        let (folder, error) = run(&["program", "man", "--out", "/no/such/folder"]).unwrap_err();
        assert_eq!((folder.to_str(), error.kind()), (Some("/no/such/folder"), io::ErrorKind::NotFound));
    }

    #[test]
    fn completions_name_the_commands() {
        let script = run(&["program", "completions", "bash"]).unwrap();
        assert!(String::from_utf8(script).unwrap().contains("program__subcmd__act"));
    }
}
