//! Sentences for the user about what was left out, each with how often it applies.

use std::collections::BTreeMap;

/// A sentence that applies to many objects is kept once and counted.
#[derive(Default)]
pub(super) struct Remarks(BTreeMap<String, usize>);

impl Remarks {
    /// Says `sentence` (without a full stop) once more.
    pub fn add(&mut self, sentence: impl Into<String>) {
        self.add_times(sentence, 1);
    }

    /// Says `sentence` of `times` objects; nothing if there are none.
    pub fn add_times(&mut self, sentence: impl Into<String>, times: usize) {
        if times > 0 {
            *self.0.entry(sentence.into()).or_default() += times;
        }
    }

    /// One finished sentence each, in alphabetical order.
    pub fn into_sentences(self) -> Vec<String> {
        let finish = |(sentence, times)| match times {
            1 => format!("{sentence}."),
            _ => format!("{sentence} ({times} times)."),
        };
        self.0.into_iter().map(finish).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_remarks_are_counted() {
        let mut remarks = Remarks::default();
        remarks.add("b");
        remarks.add("a");
        remarks.add("b");
        remarks.add_times("never", 0);
        assert_eq!(remarks.into_sentences(), ["a.", "b (2 times)."]);
    }
}
