// Extra color layers of a step that averages color: each is a plane of an array, and gets color's
// weights. The host's side of it is chain/pass/pass.h (add_layered_step()).
//
// LAYERS: how many of them the step does, from layers_first on; not defined: none
// LAYERS_ONLY: it does nothing else: all that STORE would write, another step writes
//
// A shader holds LAYERS sums beside that of color, under #ifdef LAYERS:
//
//   layout(binding = ...) uniform sampler2DArray layers;
//   layout(binding = ...) writeonly uniform image2DArray layers_blurred;
//   FOR_LAYERS(i) sums[i] += weight * LAYER_FETCH(layers, at, i);

#ifdef LAYERS
#ifdef VULKAN
const int layers_first = 0;  // a guest's frame has few layers
#else
layout(location = 1) uniform int layers_first;  // Step::first_layer
#endif
#endif

#define FOR_LAYERS(i) for (int i = 0; i < LAYERS; ++i)
// Coordinate of pixel `at` in layer i of this step.
#define LAYER(at, i) ivec3(at, layers_first + (i))
#define LAYER_FETCH(array, at, i) texelFetch(array, LAYER(at, i), 0)
// A stored value is computed as written, without fused multiplications: each variant of a program
// has the same bits (precise; functions say it of what they return).
#define LAYER_STORE(array, at, i, value)                \
    {                                                   \
        precise const vec4 to_store = value;            \
        imageStore(array, LAYER(at, i), to_store);      \
    }

#ifdef LAYERS_ONLY
#define STORE(image, at, value)
#else
#define STORE(image, at, value)              \
    {                                        \
        precise const vec4 to_store = value; \
        imageStore(image, at, to_store);     \
    }
#endif
