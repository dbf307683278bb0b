//! Lines of a stream, one by one as they arrive, each of bounded length.

use super::error::StreamError;
use std::io::BufRead;

/// Bytes. A frame of 33 points is 3 kB as JSON, a `.trc` frame of 200 markers 10 kB; what is a hundred times longer is no
/// stream, and a line of unlimited length would fill the memory.
pub const LONGEST_LINE: usize = 1 << 20;

/// One line with content.
#[derive(Debug, PartialEq)]
pub struct Line {
    /// Its number, from 1.
    pub number: usize,
    /// Its text, without the line end.
    pub text: String,
    /// Whether a line end follows; a last line without one may be incomplete.
    pub is_ended: bool,
}

/// The lines of a stream.
pub struct Lines<R> {
    input: R,
    number: usize,
}

impl<R: BufRead> Lines<R> {
    /// Over an input.
    pub fn new(input: R) -> Self {
        Self { input, number: 0 }
    }

    /// The next line that is not blank; `None` at the end.
    ///
    /// **Errors** a line that is too long or not UTF-8, UTF-16 text, and what the system reports.
    pub fn next_line(&mut self) -> Option<Result<Line, StreamError>> {
        loop {
            match self.read_line() {
                Ok(None) => return None,
                Ok(Some(line)) if line.text.trim().is_empty() => {}
                Ok(Some(line)) => return Some(Ok(line)),
                Err(error) => return Some(Err(error)),
            }
        }
    }

    fn read_line(&mut self) -> Result<Option<Line>, StreamError> {
        let mut bytes = Vec::new();
        let mut is_too_long = false;
        let mut is_ended = false;
        let mut has_begun = false;
        while !is_ended {
            let arrived = match self.input.fill_buf() {
                Ok(arrived) => arrived,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(StreamError::Read { line: self.number, cause: error.to_string() }),
            };
            if arrived.is_empty() {
                break;
            }
            has_begun = true;
            let end = arrived.iter().position(|&byte| byte == b'\n');
            let part = &arrived[..end.unwrap_or(arrived.len())];
            is_too_long |= bytes.len() + part.len() > LONGEST_LINE;
            if !is_too_long {
                bytes.extend_from_slice(part);
            }
            let used = part.len() + usize::from(end.is_some());
            is_ended = end.is_some();
            self.input.consume(used);
        }
        if !has_begun {
            return Ok(None);
        }
        self.number += 1;
        if is_too_long {
            return Err(StreamError::LineTooLong { line: self.number, most: LONGEST_LINE });
        }
        let mut content = bytes.as_slice();
        if self.number == 1 {
            // UTF-16 is recognised by its byte order mark, or by the zero bytes of its ASCII characters.
            if content.starts_with(&[0xff, 0xfe])
                || content.starts_with(&[0xfe, 0xff])
                || content.iter().take(2).any(|&byte| byte == 0)
            {
                return Err(StreamError::Utf16);
            }
            content = content.strip_prefix("\u{feff}".as_bytes()).unwrap_or(content);
        }
        let content = content.strip_suffix(b"\r").unwrap_or(content);
        match std::str::from_utf8(content) {
            Ok(text) => Ok(Some(Line { number: self.number, text: text.into(), is_ended })),
            Err(_) if !is_ended => Err(StreamError::Truncated { line: self.number }),
            Err(_) => Err(StreamError::NotAFrame {
                line: self.number,
                expected: "UTF-8 text".into(),
                found: "other bytes".into(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    fn texts(input: &[u8]) -> Vec<String> {
        let mut lines = Lines::new(input);
        std::iter::from_fn(|| lines.next_line()).map(|line| line.map_or_else(|e| e.to_string(), |l| l.text)).collect()
    }

    #[test]
    fn lines_come_without_blanks_byte_order_mark_and_line_ends() {
        assert_eq!(texts("\u{feff}a\r\n\n  \nb\n\tc".as_bytes()), ["a", "b", "\tc"]);
        assert!(texts(b"").is_empty());
        let mut lines = Lines::new(b"\n\na\nb".as_slice());
        let [a, b] = [(); 2].map(|()| lines.next_line().unwrap().unwrap());
        assert_eq!((a.number, a.is_ended, b.number, b.is_ended), (3, true, 4, false));
    }

    #[test]
    fn utf_16_is_refused() {
        for input in [b"\xff\xfe{\0".as_slice(), b"\xfe\xff\0{", b"{\0\"\0", b"\0{"] {
            assert!(matches!(Lines::new(input).next_line(), Some(Err(StreamError::Utf16))), "{input:?}");
        }
    }

    #[test]
    fn a_long_line_is_refused_without_being_kept_and_the_next_is_read() {
        let input = std::io::repeat(b'x').take(LONGEST_LINE as u64 * 3).chain(b"\nnext\n".as_slice());
        let mut lines = Lines::new(std::io::BufReader::new(input));
        assert!(matches!(lines.next_line(), Some(Err(StreamError::LineTooLong { line: 1, .. }))));
        assert_eq!(lines.next_line().unwrap().unwrap().text, "next");
        assert!(lines.next_line().is_none());
    }

    #[test]
    fn other_bytes_than_utf_8_are_refused() {
        assert_eq!(texts(b"a\nb\xff\nc"), ["a", "line 2: expected UTF-8 text, found other bytes", "c"]);
        assert_eq!(texts(b"a\n\xe2\x82"), ["a", "the stream ends in the middle of line 2"]);
    }
}
