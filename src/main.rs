//! The command line: parse, run, exit code.

fn main() -> std::process::ExitCode {
    overcoat::cli::main(std::env::args_os())
}
