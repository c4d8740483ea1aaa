// Tile order: 32 consecutive indices cover 8x4 pixels, so that a warp's rays are neighbours.
#ifndef TILES_GLSL
#define TILES_GLSL
#include "shared.glsl"

// Pixel of a tile-order index; outside the picture for the padding of the last tiles.
uvec2 tile_pixel(uint index, uint width) {
    uint tiles = (width + TILE_WIDTH - 1u) / TILE_WIDTH;
    uint tile = index / WARP, lane = index % WARP;
    return uvec2(tile % tiles * TILE_WIDTH + lane % TILE_WIDTH, tile / tiles * TILE_HEIGHT + lane / TILE_WIDTH);
}
#endif
