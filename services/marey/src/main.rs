//! The `marey` command.

fn main() -> std::process::ExitCode {
    marey::main()
}
