//! Enough of the grammar of Rust to read paths: words and signs, without comments and literals.

/// A word, or one sign (`::` is one).
#[derive(Clone, Debug, PartialEq)]
pub struct Token {
    pub text: String,
    /// From 1.
    pub line: usize,
}

/// The tokens of a Rust file. String, character and byte literals come as `"`, lifetimes are dropped.
pub fn tokens(source: &str) -> Vec<Token> {
    let chars: Vec<char> = source.chars().collect();
    let (mut at, mut line, mut found) = (0, 1, Vec::new());
    while at < chars.len() {
        let length = length_at(&chars[at..]);
        let text: String = chars[at..at + length].iter().collect();
        if let Some(text) = shown(&text) {
            found.push(Token { text, line });
        }
        line += text.matches('\n').count();
        at += length;
    }
    found
}

/// What stands for a piece of source among the tokens; `None` for what is left out.
fn shown(text: &str) -> Option<String> {
    let first = text.chars().next()?;
    if first.is_whitespace() || text.starts_with("//") || text.starts_with("/*") {
        return None;
    }
    if text.ends_with(['"', '#']) && text.contains('"') || (first == '\'' && text.len() > 1 && text.ends_with('\'')) {
        return Some("\"".into());
    }
    (first != '\'').then(|| text.into())
}

/// How many characters the first piece has: a comment, a literal, a word or a sign.
fn length_at(rest: &[char]) -> usize {
    let next = |k: usize| rest.get(k).copied().unwrap_or('\0');
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let until = |from: usize, stop: &dyn Fn(usize) -> bool| (from..rest.len()).find(|&k| stop(k)).unwrap_or(rest.len());
    match (next(0), next(1)) {
        ('/', '/') => until(2, &|k| rest[k] == '\n'),
        ('/', '*') => {
            let (mut depth, mut k) = (1, 2);
            while depth > 0 && k < rest.len() {
                match (next(k), next(k + 1)) {
                    ('/', '*') => (depth, k) = (depth + 1, k + 2),
                    ('*', '/') => (depth, k) = (depth - 1, k + 2),
                    _ => k += 1,
                }
            }
            k.min(rest.len())
        }
        ('"', _) => 1 + quoted(&rest[1..]),
        ('b', '"') => 2 + quoted(&rest[2..]),
        ('r', '"' | '#') | ('b', 'r') if raw_hashes(rest).is_some() => {
            let (start, hashes) = raw_hashes(rest).unwrap();
            let ends = |k: usize| rest[k] == '"' && (1..=hashes).all(|h| next(k + h) == '#');
            (until(start, &ends) + 1 + hashes).min(rest.len())
        }
        ('\'', '\\') => (until(3, &|k| rest[k] == '\'') + 1).min(rest.len()),
        ('\'', _) if next(2) == '\'' => 3,
        ('\'', c) if is_word(c) => until(1, &|k| !is_word(rest[k])),
        (':', ':') => 2,
        (c, _) if is_word(c) => until(0, &|k| !is_word(rest[k])),
        _ => 1,
    }
}

/// Characters to the end of a string, the closing quote included.
fn quoted(rest: &[char]) -> usize {
    let mut k = 0;
    while k < rest.len() && rest[k] != '"' {
        k += if rest[k] == '\\' { 2 } else { 1 };
    }
    (k + 1).min(rest.len())
}

/// For `r"`, `r#"`, `br##"` …: where the text begins and how many hashes end it.
fn raw_hashes(rest: &[char]) -> Option<(usize, usize)> {
    let marks = rest.iter().take_while(|c| matches!(c, 'b' | 'r')).count();
    let hashes = rest[marks..].iter().take_while(|&&c| c == '#').count();
    (rest.get(marks + hashes) == Some(&'"')).then_some((marks + hashes + 1, hashes))
}

#[test]
fn comments_literals_and_lifetimes_are_left_out() {
    let words = |source: &str| tokens(source).into_iter().map(|t| t.text).collect::<Vec<_>>().join(" ");
    assert_eq!(words("a /* b /* c */ d */ e // f\ng"), "a e g");
    assert_eq!(words(r##"x("a\"b", r#"c"d"#, b"e", 'f', '\'', '\u{41}') y"##), "x ( \" , \" , \" , \" , \" , \" ) y");
    assert_eq!(words("fn f<'a>(x: &'a str) -> crate::A<'_>"), "fn f < > ( x : & str ) - > crate :: A < >");
    assert_eq!(tokens("a\n\"x\ny\"\nb").last().unwrap().line, 4);
}
