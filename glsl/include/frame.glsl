// What all kernels of a picture share: the frame and where a path is in its batch.
#ifndef FRAME_GLSL
#define FRAME_GLSL
#include "types.glsl"

layout(local_size_x = 32) in;

layout(set = 0, binding = 0, std430) readonly buffer FrameBuffer { Frame frame; };

layout(push_constant, std430) uniform StagePush {
    uint first; // index of the batch's first path among those of the chosen tiles
    uint count; // paths in the batch
    uint sample_index;
    uint argument; // of the stage: light, ray kind, or samples of this pass so far
} push;
#endif
