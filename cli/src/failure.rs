//! Why a verb could not run, in words.

use std::error::Error;

use truedepth::{files, image, measure, recording};

/// Why a verb could not run: a message, what lay behind it, and what to do. Every error of the library turns into one
/// with `?`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    /// What could not be done, naming the file.
    pub(crate) message: String,
    /// What lay behind it, nearest first.
    pub(crate) causes: Vec<String>,
    /// What to do about it, where the message does not say so itself.
    pub(crate) hint: Option<String>,
}

impl Failure {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), causes: Vec::new(), hint: None }
    }

    pub(crate) fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// This failure as the cause of a wider one.
    pub(crate) fn within(self, message: impl Into<String>) -> Self {
        let mut causes = vec![self.message];
        causes.extend(self.causes);
        Self { message: message.into(), causes, hint: self.hint }
    }
}

/// True where a limit on what files may ask for was met.
fn is_limit(error: &(dyn Error + 'static)) -> bool {
    let recording = match error.downcast_ref() {
        Some(measure::Error::Recording(error)) => Some(error),
        _ => error.downcast_ref(),
    };
    let files = match recording {
        Some(recording::Error::Files(error)) => Some(error),
        _ => error.downcast_ref(),
    };
    let image = match recording {
        Some(recording::Error::Image { source, .. }) => Some(source),
        _ => error.downcast_ref(),
    };
    matches!(files, Some(files::Error::Limit { .. }))
        || matches!(image, Some(image::Error::Limits { .. }))
}

impl<E: Error + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        let message = error.to_string();
        let mut causes: Vec<String> = Vec::new();
        let mut source = error.source();
        while let Some(cause) = source {
            let text = cause.to_string();
            // Many errors repeat their cause in their own words; once is enough.
            if !causes.last().unwrap_or(&message).contains(&text) {
                causes.push(text);
            }
            source = cause.source();
        }
        let hint = is_limit(&error).then(|| "--trust lifts the limits".to_owned());
        Self { message, causes, hint }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug)]
    struct Chain(&'static str, Option<Box<Chain>>);

    impl std::fmt::Display for Chain {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str(self.0)
        }
    }

    impl Error for Chain {
        fn source(&self) -> Option<&(dyn Error + 'static)> {
            self.1.as_deref().map(|e| e as _)
        }
    }

    #[test]
    fn a_chain_is_told_once() {
        let inner = Chain("no such file", None);
        let middle = Chain("cannot read a.json: no such file", Some(Box::new(inner)));
        let failure = Failure::from(Chain("no recording in x", Some(Box::new(middle))));
        assert_eq!(failure.message, "no recording in x");
        assert_eq!(failure.causes, ["cannot read a.json: no such file"]);
        let wider = failure.within("audit of x").hint("try y");
        assert_eq!(wider.causes, ["no recording in x", "cannot read a.json: no such file"]);
        assert_eq!(wider.hint.as_deref(), Some("try y"));
    }
}
