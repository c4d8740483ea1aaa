//! Twin of `tiles.glsl`: 32 consecutive indices cover 8x4 pixels, in Morton order.

use crate::shared::{TILE_HEIGHT, TILE_WIDTH, WARP};

/// Pixel `(x, y)` of a tile-order index; outside the picture for the padding of the last tiles.
pub fn tile_pixel(index: u32, width: u32) -> (u32, u32) {
    let tiles = width.div_ceil(TILE_WIDTH);
    let (tile, lane) = (index / WARP, index % WARP);
    let (x, y) = (lane & 1 | lane >> 1 & 2 | lane >> 2 & 4, lane >> 1 & 1 | lane >> 2 & 2);
    (tile % tiles * TILE_WIDTH + x, tile / tiles * TILE_HEIGHT + y)
}

/// Tile-order indices of a picture, padding included; `None` beyond 32 bits.
pub fn tile_count(width: u32, height: u32) -> Option<u32> {
    let tiles = u64::from(width.div_ceil(TILE_WIDTH)) * u64::from(height.div_ceil(TILE_HEIGHT));
    u32::try_from(tiles * u64::from(WARP)).ok()
}
