//! Lists, strips and fans to triangles.

use gltf::json::mesh::Mode;

/// How a sequence of corners becomes triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Topology {
    List,
    Strip,
    Fan,
}

impl Topology {
    /// `None` for points and lines.
    pub fn of(mode: Mode) -> Option<Self> {
        match mode {
            Mode::Triangles => Some(Topology::List),
            Mode::TriangleStrip => Some(Topology::Strip),
            Mode::TriangleFan => Some(Topology::Fan),
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
        }
    }

    /// Number of whole triangles in a sequence of `corners`.
    pub fn triangles(self, corners: u64) -> u64 {
        match self {
            Topology::List => corners / 3,
            Topology::Strip | Topology::Fan => corners.saturating_sub(2),
        }
    }

    /// Where in the sequence the corners of triangle `i` are (glTF 2.0, section 3.7.2.1), in an order that
    /// keeps the winding.
    pub fn corners(self, i: usize) -> [usize; 3] {
        match self {
            Topology::List => [3 * i, 3 * i + 1, 3 * i + 2],
            Topology::Strip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Topology::Fan => [i + 1, i + 2, 0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_those_of_the_specification() {
        assert_eq!(Topology::List.corners(1), [3, 4, 5]);
        assert_eq!([0, 1, 2].map(|i| Topology::Strip.corners(i)), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!([0, 1].map(|i| Topology::Fan.corners(i)), [[1, 2, 0], [2, 3, 0]]);
    }

    #[test]
    fn incomplete_triangles_do_not_count() {
        assert_eq!([0, 2, 3, 8].map(|n| Topology::List.triangles(n)), [0, 0, 1, 2]);
        assert_eq!([0, 1, 2, 3, 5].map(|n| Topology::Strip.triangles(n)), [0, 0, 0, 1, 3]);
    }
}
