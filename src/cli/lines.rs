//! The lines of an input error as miette draws them.

use std::fmt;

use miette::{
    Diagnostic, LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents,
};
use vibrissa::error::InputError;
use vibrissa::excerpt::Excerpt;

/// An error with the lines around it.
#[derive(Debug)]
pub struct Shown<'a> {
    error: &'a InputError,
    lines: Option<Lines<'a>>,
}

#[derive(Debug)]
struct Lines<'a>(&'a Excerpt);

impl<'a> Shown<'a> {
    pub fn new(error: &'a InputError) -> Self {
        Self { error, lines: error.snippet.as_deref().map(Lines) }
    }
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for Shown<'_> {}

impl Diagnostic for Shown<'_> {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(self.lines.as_ref()?)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.lines.as_ref()?.0.span.clone();
        Some(Box::new(std::iter::once(LabeledSpan::underline(span))))
    }
}

impl SourceCode for Lines<'_> {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let Excerpt { file, text, above, left, .. } = self.0;
        let part = text.as_str().read_span(span, before, after)?;
        // Of a label alone the column is asked, of lines it is always 0.
        let column = if part.column() > 0 { part.column() + left } else { 0 };
        let line = part.line() + above;
        let whole = MietteSpanContents::new_named(
            file.clone(),
            part.data(),
            *part.span(),
            line,
            column,
            part.line_count(),
        );
        Ok(Box::new(whole))
    }
}
