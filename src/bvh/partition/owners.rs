//! Which SM owns which subtree.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// How subtrees are given to SMs. Either way each gets about the same expected work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Owners {
    /// Neighbours in the tree to the same SM: rays change SM less often.
    #[default]
    Adjacent,
    /// The most work first, each to the SM with the least so far (Graham 1969): neighbours are spread, and
    /// a part of the scene that many rays meet is shared by more SMs.
    Scattered,
}

impl Owners {
    /// The owner of each subtree, given its expected work.
    pub fn assign(self, work: &[f64], sms: u32) -> Vec<u32> {
        match self {
            Owners::Adjacent => adjacent(work, sms),
            Owners::Scattered => scattered(work, sms),
        }
    }
}

/// Cuts the sequence where the sum passes a multiple of an SM's share.
fn adjacent(work: &[f64], sms: u32) -> Vec<u32> {
    let total: f64 = work.iter().sum();
    // Work of scenes without area is all 0: subtrees count alike then.
    let (weight, total): (&dyn Fn(usize) -> f64, f64) =
        if total > 0.0 { (&|i| work[i], total) } else { (&|_| 1.0, work.len() as f64) };
    let mut before = 0.0;
    (0..work.len())
        .map(|i| {
            let middle = before + 0.5 * weight(i);
            before += weight(i);
            ((middle / total * f64::from(sms)) as u32).min(sms - 1)
        })
        .collect()
}

fn scattered(work: &[f64], sms: u32) -> Vec<u32> {
    let mut order: Vec<usize> = (0..work.len()).collect();
    order.sort_by(|&a, &b| work[b].total_cmp(&work[a]).then(a.cmp(&b)));
    // Work is at least 0, and bits of such floats are in the order of their values.
    let mut loads: BinaryHeap<Reverse<(u64, usize, u32)>> = (0..sms).map(|sm| Reverse((0, 0, sm))).collect();
    let mut owners = vec![0; work.len()];
    for subtree in order {
        let Reverse((load, owned, sm)) = loads.pop().unwrap_or_else(|| unreachable!("there is at least one SM"));
        owners[subtree] = sm;
        loads.push(Reverse(((f64::from_bits(load) + work[subtree]).to_bits(), owned + 1, sm)));
    }
    owners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loads(owners: &[u32], work: &[f64], sms: u32) -> Vec<f64> {
        let mut loads = vec![0.0; sms as usize];
        owners.iter().zip(work).for_each(|(&owner, work)| loads[owner as usize] += work);
        loads
    }

    #[test]
    fn expected_work_is_balanced_to_one_subtree() {
        let work: Vec<f64> = (0..1000).map(|i| f64::from(i * 7919 % 101)).collect();
        let share = work.iter().sum::<f64>() / 15.0;
        for owners in [Owners::Adjacent, Owners::Scattered] {
            let assigned = owners.assign(&work, 15);
            let worst = loads(&assigned, &work, 15).iter().map(|load| (load - share).abs()).fold(0.0, f64::max);
            assert!(worst <= 101.0, "{owners:?} is off by {worst}");
        }
        assert!(Owners::Adjacent.assign(&work, 15).is_sorted());
        assert!(!Owners::Scattered.assign(&work, 15).is_sorted());
    }

    #[test]
    fn more_sms_than_subtrees_and_no_work_are_legal() {
        for owners in [Owners::Adjacent, Owners::Scattered] {
            assert!(owners.assign(&[], 8).is_empty());
            assert!(owners.assign(&[1.0, 2.0], 32).iter().all(|&owner| owner < 32));
            let mut all = owners.assign(&[0.0; 64], 32);
            all.sort_unstable();
            assert_eq!(all, (0..32).flat_map(|sm| [sm, sm]).collect::<Vec<_>>(), "{owners:?}");
        }
    }
}
