//! Reads answers: from a terminal, with history and completion, or line by line from a pipe.

use crate::cli::console::print_line;
use rustyline::completion::{Completer, FilenameCompleter, Pair};
use rustyline::error::ReadlineError;
use rustyline::highlight::Highlighter;
use rustyline::hint::Hinter;
use rustyline::history::FileHistory;
use rustyline::validate::Validator;
use rustyline::{Editor, Helper};
use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};

/// Candidates for completion.
#[derive(Default)]
pub(super) struct Hints {
    /// Commands, and garment kinds if the question asks for one.
    pub words: Vec<String>,
    /// Layers of the session.
    pub layers: Vec<String>,
}

/// The source of answers.
pub(super) enum Ask {
    /// A terminal; the history is stored in the session.
    Person { editor: Box<Editor<Completion, FileHistory>>, history: PathBuf },
    /// A pipe; its lines are echoed, so that the transcript is complete.
    Pipe { silent: bool },
}

impl Ask {
    pub(super) fn open(dir: &Path, silent: bool) -> anyhow::Result<Self> {
        if !std::io::stdin().is_terminal() {
            return Ok(Self::Pipe { silent });
        }
        let mut editor = Editor::new()?;
        editor.set_helper(Some(Completion { hints: Hints::default(), files: FilenameCompleter::new() }));
        let history = dir.join("record.history");
        // A new session has no history.
        let _ = editor.load_history(&history);
        Ok(Self::Person { editor: Box::new(editor), history })
    }

    /// Reads one answer; `None` at the end of the input.
    pub(super) fn ask(&mut self, prompt: &str, hints: Hints) -> anyhow::Result<Option<String>> {
        match self {
            Self::Pipe { silent } => {
                let mut line = Vec::new();
                if std::io::stdin().lock().read_until(b'\n', &mut line)? == 0 {
                    return Ok(None);
                }
                // What is not text matches no answer, and is reported as such.
                let line = String::from_utf8_lossy(&line).into_owned();
                if !*silent {
                    print_line(&format!("{prompt}{}", line.trim_end()));
                }
                Ok(Some(line))
            }
            Self::Person { editor, history } => {
                if let Some(helper) = editor.helper_mut() {
                    helper.hints = hints;
                }
                match editor.readline(prompt) {
                    Ok(line) => {
                        // Continue if the history cannot be saved.
                        let _ = editor.add_history_entry(line.as_str());
                        let _ = editor.save_history(history);
                        Ok(Some(line))
                    }
                    Err(ReadlineError::Eof | ReadlineError::Interrupted) => Ok(None),
                    Err(e) => Err(e.into()),
                }
            }
        }
    }
}

/// Completes words and layers at the start of a word, and paths everywhere.
pub(super) struct Completion {
    hints: Hints,
    files: FilenameCompleter,
}

impl Completer for Completion {
    type Candidate = Pair;

    fn complete(&self, line: &str, pos: usize, _: &rustyline::Context<'_>) -> rustyline::Result<(usize, Vec<Pair>)> {
        let start = line[..pos].rfind(' ').map_or(0, |at| at + 1);
        let begun = &line[start..pos];
        let of_place = if start == 0 { &self.hints.words } else { &self.hints.layers };
        let mut found: Vec<Pair> = of_place
            .iter()
            .filter(|word| word.starts_with(begun))
            .map(|word| Pair { display: word.clone(), replacement: format!("{word} ") })
            .collect();
        let (from, files) = self.files.complete_path(line, pos)?;
        // If the last part of a path can be completed, words are not candidates.
        if from == start {
            found.extend(files);
        } else if found.is_empty() {
            return Ok((from, files));
        }
        Ok((start, found))
    }
}

impl Hinter for Completion {
    type Hint = String;
}
impl Highlighter for Completion {}
impl Validator for Completion {}
impl Helper for Completion {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_complete_at_the_start_layers_after_it_and_paths_everywhere() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("skirt.ply"), b"").unwrap();
        let hints = Hints { words: vec!["skip".into(), "skirt".into(), "mask".into()], layers: vec!["tshirt".into()] };
        let completion = Completion { hints, files: FilenameCompleter::new() };
        let history = FileHistory::default();
        let context = rustyline::Context::new(&history);
        let complete = |line: &str| -> Vec<String> {
            completion.complete(line, line.len(), &context).unwrap().1.into_iter().map(|p| p.replacement).collect()
        };
        assert_eq!(complete("sk"), ["skip ", "skirt "]);
        assert_eq!(complete("mask ts"), ["tshirt "]);
        let path = complete(&format!("mask {}/sk", dir.path().display()));
        assert!(path.len() == 1 && path[0].ends_with("skirt.ply"), "{path:?}");
    }
}
