//! Basic blocks of kernels, and which of them a nesting of loops has.

use serde::Deserialize;

/// Nesting of a kernel's loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Loops {
    /// Nodes until all lanes have a leaf, then leaves until all lanes have a node (Aila and Laine 2009).
    WhileWhile,
    /// As above, but a lane with a leaf goes on through nodes until all lanes have one.
    SpeculativeWhileWhile,
    /// One walk of the top tree (`glsl/include/schedule.glsl`).
    Schedule,
    /// Rays taken from queues; of each its subtree as `while-while`, then a walk of the top tree
    /// (`glsl/include/migrate.glsl`).
    Subtree,
    /// The counting sort (`glsl/include/queue.glsl`).
    Queue,
}

/// Basic blocks, in the order of the code: control that passes to the next block falls through, any other is a jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Block {
    /// From launch to the loops.
    Entry,
    /// A ray is taken from a queue.
    Take,
    /// It enters its subtree.
    Enter,
    /// Head of the outer loop.
    Outer,
    /// Box tests of a node.
    Node,
    /// At least one child was met: which is next?
    Descend,
    /// Both were met: the farther goes on the stack.
    Push,
    /// None was met: the next comes off the stack.
    Pop,
    /// Foot of the node loop.
    NodeEnd,
    /// Head of a leaf.
    Leaf,
    /// Reads what is next in a leaf: a triangle, or the mark at its end.
    Mark,
    /// Test of one triangle.
    Triangle,
    /// Foot of the leaf loop: the next comes off the stack.
    LeafPop,
    /// Foot of the outer loop.
    OuterEnd,
    /// Head of a walk of the top tree.
    Walk,
    /// A walk that begins at a subtree's end reads the links of the node above.
    Links,
    /// To the node above.
    Climb,
    /// At the node with a child pending: takes it up.
    Resume,
    /// Box tests of a node of the top tree.
    Top,
    /// Foot of the walk.
    WalkEnd,
    /// Is there a next subtree, and has it the same owner?
    Choose,
    /// There is one: reads whose it is.
    Owner,
    /// A ray is put into a queue, or has ended.
    Store,
    /// Clears a count of a queue kernel's own.
    Clear,
    /// Counts an entry.
    Tally,
    /// Sums a digit over 32 lanes and writes it.
    Total,
    /// The same, turned into places.
    Place,
    /// Moves an entry.
    Move,
    /// Adds a count.
    Sum,
    /// A step of the prefix sum of a block.
    Scan,
    /// Turns a count into a place.
    Spread,
    /// A step of a binary search.
    Search,
    /// Writes what was found.
    Share,
    /// End of the kernel.
    Exit,
}

impl Block {
    /// All blocks in the order of the code.
    pub const ALL: [Block; 34] = [
        Block::Entry,
        Block::Take,
        Block::Enter,
        Block::Outer,
        Block::Node,
        Block::Descend,
        Block::Push,
        Block::Pop,
        Block::NodeEnd,
        Block::Leaf,
        Block::Mark,
        Block::Triangle,
        Block::LeafPop,
        Block::OuterEnd,
        Block::Walk,
        Block::Links,
        Block::Climb,
        Block::Resume,
        Block::Top,
        Block::WalkEnd,
        Block::Choose,
        Block::Owner,
        Block::Store,
        Block::Clear,
        Block::Tally,
        Block::Total,
        Block::Place,
        Block::Move,
        Block::Sum,
        Block::Scan,
        Block::Spread,
        Block::Search,
        Block::Share,
        Block::Exit,
    ];

    /// Whether it visits a node or a leaf.
    pub fn visits(self) -> bool {
        matches!(self, Block::Node | Block::Leaf | Block::Top)
    }
}

/// Bytes of a record that one instruction loads or stores.
pub const RECORD_PART: usize = 16;

/// A block with the number of its loads and of its stores.
type Shape = (Block, usize, usize);

const NODES: &[Shape] = &[
    (Block::Outer, 0, 0),
    (Block::Node, 3, 0),
    (Block::Descend, 1, 0),
    (Block::Push, 0, 1),
    (Block::Pop, 1, 0),
    (Block::NodeEnd, 0, 0),
    (Block::Leaf, 0, 0),
    (Block::LeafPop, 1, 0),
    (Block::OuterEnd, 0, 0),
];

/// A leaf whose triangles are counted.
const COUNTED: &[Shape] = &[(Block::Triangle, 3, 0)];

/// A leaf that ends in a mark, which stands where the first part of a triangle would.
const MARKED: &[Shape] = &[(Block::Mark, 1, 0), (Block::Triangle, 2, 0)];

const WALK: &[Shape] = &[
    (Block::Walk, 0, 0),
    (Block::Links, 1, 0),
    (Block::Climb, 1, 0),
    (Block::Resume, 0, 0),
    (Block::Top, 4, 0),
    (Block::WalkEnd, 0, 0),
    (Block::Choose, 0, 0),
    (Block::Owner, 1, 0),
    (Block::Store, 0, 3),
];

const SORT: &[Shape] = &[
    (Block::Clear, 0, 0),
    (Block::Tally, 1, 0),
    (Block::Total, 0, 1),
    (Block::Place, 1, 0),
    (Block::Move, 1, 1),
    (Block::Sum, 1, 0),
    (Block::Scan, 0, 0),
    (Block::Spread, 1, 1),
    (Block::Search, 1, 0),
    (Block::Share, 0, 1),
];

impl Loops {
    /// The blocks of these loops, each with its loads and stores, where a ray's record has `record` bytes: a load
    /// each 16 of them and one for the entry of the queue; half of them are written back.
    pub fn blocks(self, record: u32) -> impl Iterator<Item = Shape> {
        let (entry, parts, exit): (Shape, &[&[Shape]], Shape) = match self {
            Loops::WhileWhile => ((Block::Entry, 2, 1), &[NODES, COUNTED], (Block::Exit, 0, 1)),
            Loops::SpeculativeWhileWhile => ((Block::Entry, 2, 1), &[NODES, MARKED], (Block::Exit, 0, 1)),
            Loops::Schedule => ((Block::Entry, 2, 0), &[WALK], (Block::Exit, 0, 0)),
            Loops::Subtree => {
                const STAY: &[Shape] = &[(Block::Take, 5, 0), (Block::Enter, 1, 0)];
                ((Block::Entry, 2, 0), &[STAY, NODES, COUNTED, WALK], (Block::Exit, 0, 0))
            }
            Loops::Queue => ((Block::Entry, 1, 0), &[SORT], (Block::Exit, 0, 0)),
        };
        let moved = move |shape: Shape| match (self, shape.0) {
            (Loops::Subtree, Block::Take) => (Block::Take, 1 + record as usize / RECORD_PART, 0),
            (Loops::Subtree, Block::Store) => (Block::Store, 0, 1 + record as usize / (2 * RECORD_PART)),
            _ => shape,
        };
        std::iter::once(entry).chain(parts.iter().flat_map(|part| part.iter().copied())).chain([exit]).map(moved)
    }
}
