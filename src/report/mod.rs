//! Results for people and other programs.

pub mod ray_dump;
