//! A study within a time limit: parts in turn, each with a share of the time left, within which its dearer measurements
//! are made or left out.

use std::time::Instant;

use serde::Serialize;

use crate::Result;

/// Part of the time limit that is planned with: what a measurement takes is only estimated before it is made.
const PLANNED: f64 = 0.85;

/// A part of the study, and how long it took.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    /// What was measured.
    pub name: String,
    /// Seconds by the clock on the wall.
    pub seconds: f64,
}

/// A measurement that was not made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Which.
    pub what: String,
    /// Why not.
    pub why: String,
}

/// What happens.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// A part begins.
    Begins(&'a str),
    /// A part ended, and how many of all have.
    Ended {
        /// The part.
        part: &'a Part,
        /// Parts that ended.
        done: usize,
        /// Parts in all.
        of: usize,
    },
}

/// How many parts there are, and how long they may take.
pub struct Plan<'a> {
    start: Instant,
    limit: Option<f64>,
    /// Weight of each part to come, the next last.
    weights: Vec<f64>,
    parts: usize,
    /// Seconds from the start until which the current part may take.
    deadline: f64,
    /// Parts that ended.
    pub finished: Vec<Part>,
    /// Measurements left out.
    pub left_out: Vec<LeftOut>,
    report: &'a dyn Fn(Progress),
}

impl<'a> Plan<'a> {
    /// For parts of these weights, in `limit` seconds if there is a limit.
    pub fn new(mut weights: Vec<f64>, limit: Option<f64>, report: &'a dyn Fn(Progress)) -> Plan<'a> {
        weights.reverse();
        let (finished, left_out) = (Vec::new(), Vec::new());
        Plan { start: Instant::now(), limit, parts: weights.len(), weights, deadline: 0.0, finished, left_out, report }
    }

    /// Seconds since the study began.
    pub fn elapsed(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Makes the next part. What earlier parts did not use is shared by it and those to come.
    ///
    /// # Errors
    /// Of the part.
    pub fn part<T>(&mut self, name: String, work: impl FnOnce(&mut Plan) -> Result<T>) -> Result<T> {
        (self.report)(Progress::Begins(&name));
        let begin = self.elapsed();
        self.deadline = self.limit.map_or(f64::INFINITY, |limit| begin + share(&self.weights, PLANNED * limit - begin));
        self.weights.pop();
        let result = work(self)?;
        self.finished.push(Part { name, seconds: self.elapsed() - begin });
        let (part, done) = (&self.finished[self.finished.len() - 1], self.parts - self.weights.len());
        (self.report)(Progress::Ended { part, done, of: self.parts });
        Ok(result)
    }

    /// Whether something that takes about `seconds` may be done.
    pub fn affords(&self, seconds: f64) -> bool {
        self.elapsed() + seconds <= self.deadline
    }

    /// Notes that something was left out which would have taken about `seconds`.
    pub fn leave_out(&mut self, what: String, seconds: f64) {
        let left = (self.deadline - self.elapsed()).max(0.0);
        let why = format!("it would take about {seconds:.0} s, and {left:.0} s of the time limit were left for it");
        self.left_out.push(LeftOut { what, why });
    }
}

/// What the last of `weights` gets of `seconds`, if all get some.
fn share(weights: &[f64], seconds: f64) -> f64 {
    let next = weights.last().copied().unwrap_or(0.0);
    seconds.max(0.0) * next / weights.iter().sum::<f64>().max(next).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    #[test]
    fn a_part_gets_its_share_and_what_others_left() {
        assert_eq!(
            (share(&[1.0, 2.0, 1.0], 80.0), share(&[1.0, 2.0], 80.0), share(&[1.0], 80.0)),
            (20.0, 80.0 * 2.0 / 3.0, 80.0)
        );
        assert_eq!((share(&[1.0], -3.0), share(&[], 5.0)), (0.0, 0.0));
    }

    #[test]
    fn what_does_not_fit_is_left_out_and_named() {
        let told = RefCell::new(Vec::new());
        let report = |progress: Progress| {
            told.borrow_mut().push(match progress {
                Progress::Begins(name) => name.to_owned(),
                Progress::Ended { part, done, of } => format!("{} {done}/{of}", part.name),
            });
        };
        let mut plan = Plan::new(vec![1.0, 3.0], Some(1000.0), &report);
        plan.part("a".to_owned(), |plan| {
            assert!(plan.affords(150.0) && !plan.affords(250.0));
            plan.leave_out("the dearest".to_owned(), 250.0);
            Ok(())
        })
        .unwrap();
        plan.part("b".to_owned(), |plan| {
            assert!(plan.affords(800.0) && !plan.affords(900.0));
            Ok(())
        })
        .unwrap();
        assert_eq!(plan.left_out[0].what, "the dearest");
        assert!(plan.left_out[0].why.contains("about 250 s"), "{}", plan.left_out[0].why);
        assert_eq!(*told.borrow(), ["a", "a 1/2", "b", "b 2/2"]);
    }

    #[test]
    fn without_a_limit_everything_fits() {
        let mut plan = Plan::new(vec![1.0], None, &|_| ());
        plan.part("a".to_owned(), |plan| {
            assert!(plan.affords(1e9));
            Ok(())
        })
        .unwrap();
    }
}
