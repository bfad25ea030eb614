//! How a run ended.

/// How a run ended, from best to worst. A verb that could do nothing at all answers with a
/// [`Failure`](crate::failure::Failure) instead.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Outcome {
    /// It ran and found no fault.
    Clean,
    /// It ran and found faults.
    Faults,
    /// Of several recordings at least one could not be worked on; why has been said already.
    NotAllRan,
}
