//! What Zhu and Deng 2013 publish, to be shown beside our own numbers.

/// One of the paper's scenes: Table I.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Scene {
    /// Its name there.
    pub name: &'static str,
    /// Vertices.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
    /// Nodes of the BVH, and as many leaves.
    pub nodes: usize,
}

/// Table I.
pub const SCENES: [Scene; 4] = [
    Scene { name: "Fairy Forest", vertices: 100_737, triangles: 174_117, nodes: 57_519 },
    Scene { name: "Conference Room", vertices: 166_907, triangles: 282_759, nodes: 103_801 },
    Scene { name: "Stanford Dragon", vertices: 435_545, triangles: 871_414, nodes: 299_504 },
    Scene { name: "Happy Buddha", vertices: 543_775, triangles: 1_087_425, nodes: 385_901 },
];

/// The conference room, of which figures 2 to 4 are.
pub const CONFERENCE: usize = 1;

/// A row of Tables II and III.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Row {
    /// Miss rate of the standard traversal.
    pub miss_standard: f64,
    /// Miss rate with thread migration.
    pub miss_improved: f64,
    /// Cycles of the standard traversal.
    pub cycles_standard: f64,
    /// Cycles with thread migration.
    pub cycles_improved: f64,
}

impl Row {
    const fn new(miss_standard: f64, miss_improved: f64, cycles_standard: f64, cycles_improved: f64) -> Row {
        Row { miss_standard, miss_improved, cycles_standard, cycles_improved }
    }

    /// Improved over standard.
    pub fn miss_ratio(&self) -> f64 {
        self.miss_improved / self.miss_standard
    }

    /// Improved over standard.
    pub fn cycle_ratio(&self) -> f64 {
        self.cycles_improved / self.cycles_standard
    }
}

/// Tables II and III: primary rays, then secondary rays, of each scene.
pub const ROWS: [[Row; 4]; 2] = [
    [
        Row::new(0.2872, 0.1409, 517_168.0, 399_729.0),
        Row::new(0.2875, 0.1888, 297_066.0, 223_943.0),
        Row::new(0.3558, 0.1736, 386_685.0, 221_619.0),
        Row::new(0.3884, 0.2300, 291_061.0, 186_805.0),
    ],
    [
        Row::new(0.3891, 0.0945, 1_748_566.0, 693_091.0),
        Row::new(0.3558, 0.0979, 1_081_839.0, 583_214.0),
        Row::new(0.4818, 0.1827, 1_581_138.0, 665_433.0),
        Row::new(0.5007, 0.1598, 3_009_938.0, 1_161_525.0),
    ],
];

/// Clusters beyond which secondary rays become slower in figure 2.
pub const KNEE: u32 = 5;

/// What the text says of figures 2 to 4, whose values it does not print.
pub const FIGURES: [&str; 3] = [
    "The paper: speed falls short of linear, and that of secondary rays declines beyond 5 clusters.",
    "The paper: network latency grows with the number of clusters.",
    "The paper: about 20 % for primary and about 40 % for secondary rays.",
];

/// What the paper does not say.
pub const OPEN: [&str; 6] = [
    "how many subtrees there are: \"a certain level\" of the tree",
    "the resolution of the simulated run: pictures have 1024 x 768 pixels, but some 300,000 cycles are a small \
     fraction of what so many rays take",
    "which secondary rays, and how many a hit: its secondary runs take 3 to 10 times the cycles of its primary runs",
    "which rays run together once they are in queues",
    "the simulator's exact version (\"3.x\") and configuration, cores a cluster (10 in one place, 15 in another)",
    "cameras, and whether a hit on a line under way counts as a miss",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_the_percentages_that_the_paper_prints() {
        let percent = |ratio: f64| (100.0 * ratio).round();
        let miss = ROWS.map(|rows| rows.map(|row| percent(row.miss_ratio())));
        assert_eq!(miss, [[49.0, 66.0, 49.0, 59.0], [24.0, 28.0, 38.0, 32.0]]);
        let cycles = ROWS.map(|rows| rows.map(|row| percent(row.cycle_ratio())));
        assert_eq!(cycles, [[77.0, 75.0, 57.0, 64.0], [40.0, 54.0, 42.0, 39.0]]);
    }
}
