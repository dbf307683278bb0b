//! A source file as tokens, with and without its tests.

use super::lexer::{Token, tokens};
use std::collections::BTreeSet;

/// A file below `src`.
pub struct SourceFile {
    /// With `/`, relative to `src`.
    pub path: String,
    pub text: String,
    pub tokens: Vec<Token>,
    /// The tokens without the items under `#[cfg(test)]`.
    pub code: Vec<Token>,
    /// The modules that the file declares under `#[cfg(test)]`.
    pub test_modules: BTreeSet<String>,
}

impl SourceFile {
    pub fn new(path: &str, text: &str) -> Self {
        let tokens = tokens(text);
        let (code, test_modules) = without_tests(&tokens);
        Self { path: path.into(), text: text.into(), tokens, code, test_modules }
    }

    /// The top-level module, or `None` for `lib.rs` and `main.rs`.
    pub fn module(&self) -> Option<&str> {
        self.path.split_once('/').map(|(module, _)| module)
    }

    /// The path of the file's module: `fit/naked/mod.rs` is `["fit", "naked"]`.
    pub fn module_path(&self) -> Vec<String> {
        let path = self.path.trim_end_matches(".rs").trim_end_matches("/mod");
        path.split('/').map(String::from).collect()
    }

    /// Whether the words from `at` on are these.
    pub fn reads(&self, at: usize, words: &[&str]) -> bool {
        words.iter().enumerate().all(|(k, word)| self.word(at + k) == *word)
    }

    pub fn word(&self, at: usize) -> &str {
        word(&self.tokens, at)
    }
}

/// The token at `at`, empty past the end.
pub fn word(tokens: &[Token], at: usize) -> &str {
    tokens.get(at).map_or("", |token| &token.text)
}

/// Drops each item under `#[cfg(test)]`, and lists the modules declared by those items.
fn without_tests(tokens: &[Token]) -> (Vec<Token>, BTreeSet<String>) {
    const MARK: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let (mut code, mut modules, mut at) = (Vec::new(), BTreeSet::new(), 0);
    while at < tokens.len() {
        if !MARK.iter().enumerate().all(|(k, mark)| word(tokens, at + k) == *mark) {
            code.push(tokens[at].clone());
            at += 1;
            continue;
        }
        let (mut depth, mut k) = (0_usize, at + MARK.len());
        while k < tokens.len() {
            match word(tokens, k) {
                "mod" if depth == 0 => {
                    modules.insert(word(tokens, k + 1).to_string());
                }
                "{" => depth += 1,
                "}" if depth == 1 => break,
                "}" => depth -= 1,
                ";" if depth == 0 => break,
                _ => {}
            }
            k += 1;
        }
        at = k + 1;
    }
    (code, modules)
}

#[test]
fn items_under_cfg_test_are_left_out() {
    let file = SourceFile::new(
        "fit/pose.rs",
        "fn a() {}\n#[cfg(test)]\nmod tests;\nfn b() {}\n#[cfg(test)] pub(crate) mod shapes { fn c() { d() } }\nfn e() {}",
    );
    let names: Vec<&str> =
        file.code.iter().map(|t| t.text.as_str()).filter(|t| t.chars().all(char::is_alphabetic)).collect();
    assert_eq!(names, ["fn", "a", "fn", "b", "fn", "e"]);
    assert_eq!(file.test_modules, ["shapes", "tests"].map(String::from).into());
    assert_eq!(file.module_path(), ["fit", "pose"]);
    assert_eq!(SourceFile::new("fit/naked/mod.rs", "").module_path(), ["fit", "naked"]);
}
