// Tile order: 32 consecutive indices cover 8x4 pixels, so that a warp's rays are neighbours. Within a tile pixels are
// in Morton order, so that the 4 to 16 lanes of a software driver are neighbours too: 8 are 4x2 pixels.
#ifndef TILES_GLSL
#define TILES_GLSL
#include "shared.glsl"

// Pixel of a tile-order index; outside the picture for the padding of the last tiles.
uvec2 tile_pixel(uint index, uint width) {
    uint tiles = (width + TILE_WIDTH - 1u) / TILE_WIDTH;
    uint tile = index / WARP, lane = index % WARP;
    uint x = (lane & 1u) | (lane >> 1 & 2u) | (lane >> 2 & 4u), y = (lane >> 1 & 1u) | (lane >> 2 & 2u);
    return uvec2(tile % tiles * TILE_WIDTH + x, tile / tiles * TILE_HEIGHT + y);
}
#endif
