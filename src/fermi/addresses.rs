//! Which slice, bank and row a line lives in.

use super::machine::{LINE, Machine};

/// Where a line lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Home {
    /// Memory channel.
    pub channel: usize,
    /// L2 slice; those of a channel are numbered one after the other.
    pub slice: usize,
    /// Number of the line within its slice.
    pub local: u64,
    /// Bank of the channel.
    pub bank: usize,
    /// Row of the bank.
    pub row: u64,
}

/// GPGPU-Sim's mapping `dramid@8`, `RRRRRRRRRRRR BBBCCCCB CCSSSSSS`: channels take turns by `interleave` bytes; of a
/// channel's own addresses the lowest bit above those is the lowest of the bank and picks the slice, then come the
/// other columns of the row, the other bits of the bank, and the row.
#[derive(Clone, Copy, Debug)]
pub struct Addresses {
    channels: u64,
    slices: u64,
    interleave: u64,
    columns: u64,
    banks: u64,
}

impl Addresses {
    /// Addresses of `machine`.
    pub fn new(machine: &Machine) -> Addresses {
        let dram = &machine.dram;
        Addresses {
            channels: u64::from(dram.channels),
            slices: u64::from(machine.l2.slices / dram.channels),
            interleave: dram.interleave,
            columns: (dram.row / dram.interleave).max(1),
            banks: u64::from(dram.banks),
        }
    }

    /// Where `line` lives.
    pub fn home(&self, line: u64) -> Home {
        let address = line * LINE;
        let (chunk, offset) = (address / self.interleave, address % self.interleave);
        let (channel, rest) = (chunk % self.channels, chunk / self.channels);
        let (low, above) = (rest % 2, rest / 2 / self.columns);
        Home {
            channel: channel as usize,
            slice: (channel * self.slices + rest % self.slices) as usize,
            local: (rest / self.slices * self.interleave + offset) / LINE,
            bank: (low + 2 * (above % (self.banks / 2))) as usize,
            row: above / (self.banks / 2),
        }
    }

    /// The line that `slice` knows by the number `local`.
    pub fn line_of(&self, slice: usize, local: u64) -> u64 {
        let (channel, part) = (slice as u64 / self.slices, slice as u64 % self.slices);
        let address = local * LINE;
        let rest = address / self.interleave * self.slices + part;
        ((rest * self.channels + channel) * self.interleave + address % self.interleave) / LINE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_line_has_a_home_of_its_own_and_the_way_back() {
        for name in Machine::known() {
            let machine = Machine::named(name, &[]).unwrap();
            let addresses = Addresses::new(&machine);
            for line in (0..100_000).chain(0x8000_0000 / LINE..0x8000_0000 / LINE + 100_000) {
                let home = addresses.home(line);
                assert!(home.slice < machine.l2.slices as usize && home.bank < machine.dram.banks as usize);
                assert_eq!(addresses.line_of(home.slice, home.local), line, "{name}");
            }
        }
    }

    #[test]
    fn lines_of_256_bytes_share_a_slice_and_the_next_are_on_the_next_channel() {
        let addresses = Addresses::new(&Machine::named("gpgpusim-3.2.2", &[]).unwrap());
        let slices: Vec<usize> = (0..26).map(|line| addresses.home(line).slice).collect();
        let expected = [0, 0, 2, 2, 4, 4, 6, 6, 8, 8, 10, 10, 1, 1, 3, 3, 5, 5, 7, 7, 9, 9, 11, 11, 0, 0];
        assert_eq!(slices, expected);
    }
}
