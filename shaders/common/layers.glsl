// Further color layers of a step that averages color: each is an array's plane, and gets the weights
// that color gets. The host's side of it is chain/layered_step.h.
//
// LAYERS: how many of them the step does; not defined: none    LAYERS_FIRST: the first of them
// LAYERS_ONLY: it does nothing else; what color is, is written by another step
//
// In a shader, with sums of LAYERS vec4:
//
//   #ifdef LAYERS
//   layout(binding = ...) uniform sampler2DArray layers;
//   layout(binding = ...) writeonly uniform image2DArray layers_blurred;
//   #endif
//   FOR_LAYERS(i) sums[i] += weight * texelFetch(layers, LAYER(at, i), 0);

// Where layer i of this step has the pixel `at`.
#define LAYER(at, i) ivec3(at, LAYERS_FIRST + (i))
#define FOR_LAYERS(i) for (int i = 0; i < LAYERS; ++i)
