//! Set-associative cache with LRU replacement, whose lines are reserved on a miss and valid when filled.

use super::machine::Mapping;

/// No line.
const NONE: u64 = u64::MAX;

/// State of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Invalid,
    /// On its way.
    Reserved,
    Valid,
    /// Valid and newer than below.
    Dirty,
}

/// What a lookup finds; numbers are of the cache's lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lookup {
    /// The line is there.
    Hit(usize),
    /// The line is on its way.
    Pending(usize),
    /// The line is not there; this one would be replaced.
    Miss(usize),
    /// It is not there and every line of its set is reserved.
    Full,
}

/// A place for each line of a launch, of those that lie one after the other from `data` on and, before these, from `stack`
/// on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Places {
    /// First line of trees, rays and hits, and their number.
    pub data: (u64, u64),
    /// First line of stacks, and their number.
    pub stack: (u64, u64),
}

/// Where a line may be.
#[derive(Clone, Copy, Debug)]
enum Index {
    /// In any way of its set.
    Sets(Mapping),
    /// In its own place.
    Places(Places),
}

/// A cache. Lines are known by number (address / line size).
#[derive(Clone, Debug)]
pub struct Cache {
    ways: usize,
    sets: u64,
    index: Index,
    tags: Vec<u64>,
    states: Vec<State>,
    used: Vec<u64>,
}

impl Cache {
    /// An empty cache of `sets`, a power of two, by `ways`.
    pub fn new(sets: u64, ways: u64, mapping: Mapping) -> Cache {
        let lines = (sets * ways) as usize;
        Cache {
            ways: ways as usize,
            sets,
            index: Index::Sets(mapping),
            tags: vec![NONE; lines],
            states: vec![State::Invalid; lines],
            used: vec![0; lines],
        }
    }

    /// An empty cache that holds all lines of a launch and so never replaces one.
    pub fn roomy(places: Places) -> Cache {
        let index = Index::Places(places);
        Cache { index, ..Cache::new(places.data.1 + places.stack.1, 1, Mapping::Linear) }
    }

    /// `count` such caches, numbered from 0.
    pub fn times(mut self, count: u32) -> Cache {
        let lines = self.tags.len() * count as usize;
        self.tags.resize(lines, NONE);
        self.states.resize(lines, State::Invalid);
        self.used.resize(lines, 0);
        self
    }

    /// Lines of all caches.
    pub fn lines(&self) -> usize {
        self.tags.len()
    }

    /// Lines that it holds.
    pub fn held(&self) -> impl Iterator<Item = u64> {
        self.tags.iter().copied().filter(|&line| line != NONE)
    }

    /// Set of line `line`.
    pub fn set(&self, line: u64) -> u64 {
        match self.index {
            Index::Sets(Mapping::Linear) => line & (self.sets - 1),
            Index::Sets(Mapping::Hashed) => hashed(line, self.sets),
            Index::Places(Places { data, .. }) if line >= data.0 => line - data.0,
            Index::Places(Places { data, stack }) => data.1 + line - stack.0,
        }
    }

    /// Looks for `line` without changing anything.
    #[inline]
    pub fn look(&self, line: u64) -> Lookup {
        self.look_in(0, line)
    }

    /// Looks for `line` in cache number `cache` without changing anything.
    #[inline]
    pub fn look_in(&self, cache: u32, line: u64) -> Lookup {
        let first = (u64::from(cache) * self.sets + self.set(line)) as usize * self.ways;
        let (mut oldest, mut age) = (None, u64::MAX);
        for way in first..first + self.ways {
            if self.tags[way] == line {
                return if self.states[way] == State::Reserved { Lookup::Pending(way) } else { Lookup::Hit(way) };
            }
            let used = if self.states[way] == State::Invalid { 0 } else { self.used[way] };
            if self.states[way] != State::Reserved && (oldest.is_none() || used < age) {
                (oldest, age) = (Some(way), used);
            }
        }
        oldest.map_or(Lookup::Full, Lookup::Miss)
    }

    /// Notes that a line was used. `now` must not fall and must start above 0.
    #[inline]
    pub fn touch(&mut self, way: usize, now: u64) {
        self.used[way] = now;
    }

    /// Gives the place `way` to `line`, which is on its way. Returns the line replaced, if that must be written back.
    pub fn reserve(&mut self, way: usize, line: u64, now: u64) -> Option<u64> {
        let replaced = (self.states[way] == State::Dirty).then_some(self.tags[way]);
        self.tags[way] = line;
        self.states[way] = State::Reserved;
        self.used[way] = now;
        replaced
    }

    /// The line reserved at `way` has come.
    pub fn fill(&mut self, way: usize) {
        self.states[way] = State::Valid;
    }

    /// The line at `way` was written here only.
    pub fn dirty(&mut self, way: usize) {
        self.states[way] = State::Dirty;
    }

    /// Forgets the line at `way`.
    pub fn evict(&mut self, way: usize) {
        self.tags[way] = NONE;
        self.states[way] = State::Invalid;
    }
}

/// Set hash of the GF100's L1 (Nugteren et al. 2014): bits 0-4 of the line address exclusive-or its bits
/// 6, 7, 8, 10 and 12, and bit 5 for 64 sets.
fn hashed(line: u64, sets: u64) -> u64 {
    let bit = |k: u32| line >> k & 1;
    let other = bit(6) | bit(7) << 1 | bit(8) << 2 | bit(10) << 3 | bit(12) << 4;
    ((line & 31) ^ other) | if sets > 32 { bit(5) << 5 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fetch(cache: &mut Cache, line: u64, now: u64) -> bool {
        match cache.look(line) {
            Lookup::Hit(way) | Lookup::Pending(way) => {
                cache.touch(way, now);
                true
            }
            Lookup::Miss(way) => {
                cache.reserve(way, line, now);
                cache.fill(way);
                false
            }
            Lookup::Full => panic!("nothing is reserved"),
        }
    }

    #[test]
    fn the_line_used_longest_ago_is_replaced() {
        let mut cache = Cache::new(1, 2, Mapping::Linear);
        let hits: Vec<bool> = [1, 2, 1, 3, 1, 2].iter().zip(1..).map(|(&l, now)| fetch(&mut cache, l, now)).collect();
        assert_eq!(hits, [false, false, true, false, true, false]);
    }

    #[test]
    fn lines_on_their_way_are_pending_and_not_replaced() {
        let mut cache = Cache::new(2, 2, Mapping::Linear);
        for line in [0, 2] {
            let Lookup::Miss(way) = cache.look(line) else { panic!("empty") };
            cache.reserve(way, line, 1);
        }
        assert!(matches!(cache.look(2), Lookup::Pending(_)));
        assert_eq!(cache.look(4), Lookup::Full);
        assert!(matches!(cache.look(1), Lookup::Miss(_)));
    }

    #[test]
    fn only_dirty_lines_are_written_back() {
        let mut cache = Cache::new(1, 1, Mapping::Linear);
        fetch(&mut cache, 7, 1);
        assert_eq!(cache.reserve(0, 8, 2), None);
        cache.fill(0);
        cache.dirty(0);
        assert_eq!(cache.reserve(0, 9, 3), Some(8));
    }

    #[test]
    fn the_hash_spreads_what_linear_sets_heap_up() {
        for sets in [32, 64] {
            let count = |mapping, stride: u64| {
                let cache = Cache::new(sets, 4, mapping);
                let all: std::collections::HashSet<u64> = (0..128).map(|i| cache.set(i * stride)).collect();
                all.len() as u64
            };
            assert_eq!((count(Mapping::Linear, 1), count(Mapping::Hashed, 1)), (sets, sets));
            assert_eq!(count(Mapping::Linear, 64), 1);
            assert!(count(Mapping::Hashed, 64) >= 8);
        }
    }
}
