//! Lines around an error, short and without characters that control a terminal.

use std::borrow::Cow;
use std::ops::Range;

const WIDE: usize = 120;
const LONG: usize = 500;
const BEFORE: usize = 40;

/// A few lines of a file and the place of the mistake in them.
#[derive(Debug, Clone)]
pub struct Excerpt {
    /// The lines.
    pub text: String,
    /// Place of the error in `text`, bytes.
    pub span: Range<usize>,
    /// Lines of the file before `text`.
    pub above: usize,
}

impl Excerpt {
    /// The first line of bytes `span` of `text`, with its neighbours.
    pub fn new(text: &str, span: Range<usize>) -> Self {
        let at = floor(text, span.start);
        let from = text[..at].rfind('\n').map_or(0, |i| i + 1);
        let line = text[from..].lines().next().unwrap_or_default();
        let start = (at - from).min(line.len());
        let end = floor(line, span.end.saturating_sub(from)).max(start);

        let before = line[..start].chars().count();
        let skipped = before.saturating_sub(BEFORE);
        let (head, left) = if skipped > 1 { ("…", skipped) } else { ("", 0) };
        let shown = cut(line.chars().skip(left));
        let marked = line[start..end].chars().count().min(WIDE.saturating_sub(before - left));
        let bytes = |n: usize| shown.chars().take(n).map(char::len_utf8).sum::<usize>();
        let inside = bytes(before - left)..bytes(before - left + marked);

        let above = text[..from].lines().next_back().map(|l| cut(l.chars()) + "\n").unwrap_or_default();
        let below = text[from..].lines().nth(1).map(|l| format!("\n{}", cut(l.chars()))).unwrap_or_default();
        let offset = above.len() + head.len();
        let lines_before = text.as_bytes()[..from].iter().filter(|b| **b == b'\n').count();
        Self {
            above: lines_before.saturating_sub(usize::from(!above.is_empty())),
            text: format!("{above}{head}{shown}{below}"),
            span: inside.start + offset..inside.end + offset,
        }
    }
}

/// The last character boundary of `text` that is not after `byte`.
fn floor(text: &str, byte: usize) -> usize {
    (0..=byte.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
}

fn cut(line: impl Iterator<Item = char>) -> String {
    first(WIDE, line)
}

fn first(most: usize, line: impl Iterator<Item = char>) -> String {
    let mut line = line.map(|c| if c == '\t' { ' ' } else { harmless(c) });
    let mut text: String = line.by_ref().take(most).collect();
    if line.next().is_some() {
        text.push('…');
    }
    text
}

/// `text` in one line, cut where it is very long.
pub fn short(text: &str) -> String {
    first(LONG, text.chars().map(|c| if c == '\n' { ' ' } else { c }))
}

/// `text` with characters replaced that control a terminal; line ends stay.
pub fn printable(text: &str) -> Cow<'_, str> {
    let fine = |c: char| c == '\n' || harmless(c) == c;
    match text.chars().all(fine) {
        true => Cow::Borrowed(text),
        false => text.chars().map(|c| if c == '\n' { c } else { harmless(c) }).collect(),
    }
}

/// Replaces control characters and marks that change the direction of writing.
fn harmless(c: char) -> char {
    match c {
        c if c.is_control() => char::REPLACEMENT_CHARACTER,
        '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}' => {
            char::REPLACEMENT_CHARACTER
        }
        c => c,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn shown(text: &str, span: Range<usize>) -> (String, String, usize) {
        let e = Excerpt::new(text, span);
        (e.text.clone(), e.text[e.span.clone()].to_owned(), e.above)
    }

    #[test]
    fn neighbours_and_the_mistake_are_shown() {
        let text = "[whisker]\r\nD = 10\r\nd\t= -4\r\nL_a = 50\r\n";
        let at = text.find("-4").unwrap();
        assert_eq!(shown(text, at..at + 2), ("D = 10\nd = -4\nL_a = 50".into(), "-4".into(), 1));
        assert_eq!(shown("é = x", 5..6), ("é = x".into(), "x".into(), 0));
        assert_eq!(shown("", 0..0), (String::new(), String::new(), 0));
        assert_eq!(shown("a\n", 2..2), ("a\n".into(), String::new(), 0));
    }

    #[test]
    fn a_mistake_far_to_the_right_is_shown_with_what_is_near() {
        let text = format!("a = 1\n{}bad{}\nb = 2", "x".repeat(200_000), "y".repeat(200_000));
        let (text, marked, _) = shown(&text, 200_006..200_009);
        assert!(text.len() < 300 && marked == "bad", "{text}");
        let (whole, marked, _) = shown(&"z".repeat(100_000), 0..100_000);
        assert!(whole.len() < 200 && marked.len() == WIDE, "{whole}");
    }

    proptest! {
        #[test]
        fn every_place_of_every_text_can_be_shown(text in any::<String>(), a in 0usize..400, b in 0usize..400) {
            let e = Excerpt::new(&text, a.min(b)..a.max(b));
            prop_assert!(e.text.get(e.span.clone()).is_some());
            prop_assert!(e.text.chars().all(|c| c == '\n' || harmless(c) == c));
        }
    }
}
