//! What the program tells of its work: machine, scene, statistics, benchmarks, dumps.

pub mod bench;
pub mod head;
pub mod machine;
pub mod ray_dump;
pub mod render;
pub mod scene;
pub mod statistics;
pub mod tracing;
pub mod verify;
