//! One number for all hits of a batch, to compare devices, strategies and versions.

use rayon::prelude::*;
use xxhash_rust::xxh3::Xxh3Default;

use super::Hit;

/// XXH3-64 over primitive id and bits of t of each hit in ray order, as 16 hexadecimal digits.
pub fn hits_digest(hits: &[Hit]) -> String {
    let mut hash = Xxh3Default::new();
    for hit in hits {
        hash.update(&hit.prim.to_le_bytes());
        hash.update(&hit.t.to_bits().to_le_bytes());
    }
    format!("{:016x}", hash.digest())
}

/// Number of rays that hit.
pub fn hit_count(hits: &[Hit]) -> u64 {
    hits.par_iter().filter(|hit| hit.is_hit()).count() as u64
}
