// The data cache of a virtual SM, in shared memory, for a workgroup that is one warp. A set is a list of lines from the one
// used last to the one used longest ago, and an invocation looks after a place in each list.
#ifndef VIRTUAL_CACHE_GLSL
#define VIRTUAL_CACHE_GLSL
#include "types.glsl"

// Number of no line.
const uint NO_LINE = 0x7FFFFFFFu;
// Added to the number of a line that is newer here than below.
const uint DIRTY = 0x80000000u;
// Place of a line that is not in its set.
const uint NOWHERE = WARP;

shared uint places[VIRTUAL_LINES];
// Place of the line in hand.
shared uint found;
// The highest line wanted, 0 if none; the turns of a loop use them alternately.
shared uint highest[2];

uint lane() { return gl_LocalInvocationID.x; }

// Set of a line: its low bits, or the hash of GF100's L1 (Nugteren et al. 2014) over 32 or 64 sets.
uint set_of(uint line, uint sets, bool hashed) {
    if (!hashed) return line & (sets - 1u);
    uint folded = bitfieldExtract(line, 6, 3) | (bitfieldExtract(line, 10, 1) << 3) | (bitfieldExtract(line, 12, 1) << 4);
    return (line ^ folded) & (sets - 1u);
}

// Looks `line` up and moves it as Fermi's L1 does: loads and pops allocate, pushes write a line that is there. Stores
// to global memory pass it by; they would evict a line, but the kernel loads nothing that it stores. Uniform control
// flow; `found` is NOWHERE before.
void look_up(uint line, uint first, uint ways, uint kind, inout AccessCounts counts) {
    bool has_place = lane() < ways;
    uint mine = has_place ? places[first + lane()] : NO_LINE;
    if ((mine & ~DIRTY) == line) found = lane();
    barrier();
    uint place = found;
    bool hit = place != NOWHERE && kind != ACCESS_STORE;
    counts.accesses += 1u;
    counts.misses += uint(!hit);
    uint last = places[first + min(place, ways - 1u)];
    if (hit || kind == ACCESS_LOAD || kind == ACCESS_POP) {
        if (!hit) counts.write_backs += last >> 31;
        uint dirty = (hit ? last & DIRTY : 0u) | (kind == ACCESS_PUSH ? DIRTY : 0u);
        if (lane() == 0u) mine = line | dirty;
        else if (lane() <= place && has_place) mine = places[first + lane() - 1u];
    }
    barrier();
    if (has_place) places[first + lane()] = mine;
}

// A memory instruction of the warp: one access for each distinct line that its lanes want, the highest first.
void access_lines(uint kind, uint line, uint sets, uint ways, bool hashed, inout AccessCounts counts) {
    uint wanted = line == NO_LINE ? 0u : line + 1u;
    if (lane() < 2u) highest[lane()] = 0u;
    barrier();
    bool any = true;
    for (uint turn = 0u; any; ++turn) {
        if (lane() == 0u) found = NOWHERE;
        atomicMax(highest[turn % 2u], wanted);
        barrier();
        uint next = highest[turn % 2u];
        any = next != 0u;
        if (any) {
            if (turn == 0u) counts.instructions += 1u;
            look_up(next - 1u, set_of(next - 1u, sets, hashed) * ways, ways, kind, counts);
            if (lane() == 0u) highest[turn % 2u] = 0u;
            if (wanted == next) wanted = 0u;
        }
    }
    barrier();
}
#endif
