//! Whether hardware can be as a machine's description says.

use super::{LINE, Machine, Mapping};
use crate::fermi::kernel::Operation;

/// A key of a description and what is wrong with its value.
type Problem = (String, String);

impl Machine {
    /// The first number that hardware cannot have.
    pub(super) fn check(&self) -> Result<(), Problem> {
        self.ranges()?;
        self.queues()?;
        self.channels()?;
        self.caches()?;
        self.timings()
    }

    fn ranges(&self) -> Result<(), Problem> {
        let positive = [
            ("sms", u64::from(self.sms), 100_000),
            ("sm.warps", u64::from(self.sm.warps), 64),
            ("sm.threads", u64::from(self.sm.threads), 2048),
            ("sm.blocks", u64::from(self.sm.blocks), 64),
            ("sm.registers", u64::from(self.sm.registers), 1 << 20),
            ("sm.shared_kib", u64::from(self.sm.shared_kib), 1024),
            ("sm.schedulers", u64::from(self.sm.schedulers), 8),
            ("sm.sp_units", u64::from(self.sm.sp_units), 8),
            ("sm.operands", self.sm.operands, 16),
            ("sm.load_queue", self.sm.load_queue as u64, 64),
            ("sm.fetch", u64::from(self.sm.fetch), 16),
            ("l1.kib", self.l1.kib, 1 << 20),
            ("l1.mshrs", self.l1.mshrs as u64, 1 << 16),
            ("l1.merges", self.l1.merges as u64, 1 << 16),
            ("texture.kib", self.texture.kib, 1 << 20),
            ("texture.latency", self.texture.latency, 10_000),
            ("texture.port", self.texture.port, 1 << 12),
            ("crossbar.flit", self.crossbar.flit, 1024),
            ("crossbar.queue", self.crossbar.queue as u64, 1 << 16),
            ("l2.slice_kib", self.l2.slice_kib, 1 << 20),
            ("l2.ways", self.l2.ways, 1 << 16),
            ("l2.mshrs", self.l2.mshrs as u64, 1 << 16),
            ("l2.merges", self.l2.merges as u64, 1 << 16),
            ("l2.queue", self.l2.queue as u64, 1 << 16),
            ("l2.port", self.l2.port, 1024),
            ("dram.channels", u64::from(self.dram.channels), 64),
            ("dram.queue", self.dram.queue as u64, 1 << 16),
            ("dram.return_queue", self.dram.return_queue as u64, 1 << 16),
            ("dram.burst", self.dram.burst, LINE),
        ];
        for (key, value, most) in positive {
            if !(1..=most).contains(&value) {
                return Err((key.to_owned(), format!("{value} is not in 1 to {most}")));
            }
        }
        for (key, value) in [("clock_mhz", self.clock_mhz), ("dram.mhz", self.dram.mhz)] {
            if !(value.is_finite() && (1.0..=1.0e5).contains(&value)) {
                return Err((key.to_owned(), format!("{value} is no clock")));
            }
        }
        Ok(())
    }

    fn queues(&self) -> Result<(), Problem> {
        // A miss queue with room for one request less than a miss may need would refuse all.
        for (key, value) in [("l1.miss_queue", self.l1.miss_queue), ("l2.miss_queue", self.l2.miss_queue)] {
            if !(3..=1 << 16).contains(&value) {
                return Err((key.to_owned(), format!("{value} is not in 3 to 65536")));
            }
        }
        Ok(())
    }

    /// Banks of the DRAM, and how slices and addresses are spread over its channels.
    fn channels(&self) -> Result<(), Problem> {
        let (banks, groups) = (self.dram.banks, self.dram.groups);
        if !banks.is_power_of_two() || !(2..=64).contains(&banks) || !groups.is_power_of_two() || groups > banks {
            return Err(("dram.banks".to_owned(), format!("{banks} banks in {groups} groups")));
        }
        let (slices, channels) = (self.l2.slices, self.dram.channels);
        if slices == 0 || !slices.is_multiple_of(channels) || !(slices / channels).is_power_of_two() {
            let problem = format!("{slices} slices for {channels} channels");
            return Err(("l2.slices".to_owned(), problem));
        }
        for (key, value) in [("dram.interleave", self.dram.interleave), ("dram.row", self.dram.row)] {
            if !value.is_power_of_two() || !(LINE..=1 << 20).contains(&value) {
                return Err((key.to_owned(), format!("{value} is no power of two from {LINE} on")));
            }
        }
        Ok(())
    }

    fn caches(&self) -> Result<(), Problem> {
        for (key, line) in [("l1.line", self.l1.line), ("l2.line", self.l2.line)] {
            if line != LINE {
                let power = if line.is_power_of_two() { "" } else { " no power of two, and" };
                return Err((key.to_owned(), format!("{line} is{power} not the {LINE} bytes by which warps coalesce")));
            }
        }
        self.geometry("l1", self.l1.kib, self.l1.ways)?;
        self.geometry("texture", self.texture.kib, self.texture.ways)?;
        if !self.l1.request.is_power_of_two() || !(16..=512).contains(&self.l1.request) {
            return Err(("l1.request".to_owned(), format!("{} is no power of two from 16 to 512", self.l1.request)));
        }
        self.geometry("l2", self.l2.slice_kib, self.l2.ways)?;
        if self.l1.mapping == Mapping::Hashed && !matches!(self.l1.sets(), 32 | 64) {
            return Err(("l1.mapping".to_owned(), format!("the hash is of 32 or 64 sets, not {}", self.l1.sets())));
        }
        Ok(())
    }

    fn timings(&self) -> Result<(), Problem> {
        for operation in [
            Operation::Simple,
            Operation::Branch,
            Operation::Add,
            Operation::Fma,
            Operation::Minmax,
            Operation::Video,
            Operation::Mul,
            Operation::Imul,
            Operation::Imad,
            Operation::Rcp,
            Operation::Shared,
        ] {
            match self.operations.get(&operation) {
                None => return Err(("operations".to_owned(), format!("no time for {operation:?}"))),
                Some(t) if t.latency < t.interval || t.interval == 0 || t.latency > 10_000 => {
                    let key = format!("operations.{operation:?}").to_lowercase();
                    return Err((key, format!("latency {} and interval {}", t.latency, t.interval)));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }

    fn geometry(&self, cache: &str, kib: u64, ways: u64) -> Result<(), Problem> {
        let lines = kib * 1024 / LINE;
        if ways == 0 || ways > lines || !lines.is_multiple_of(ways) || !(lines / ways).is_power_of_two() {
            let problem = format!("{ways} ways of {lines} lines leave no power of two of sets");
            return Err((format!("{cache}.ways"), problem));
        }
        Ok(())
    }
}
