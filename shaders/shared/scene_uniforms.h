// Uniform block and records of the generated scenes (shaders/scenes/, tools/scenes/renderer.cpp).
#ifndef POSTCHAIN_SHARED_SCENE_UNIFORMS_H
#define POSTCHAIN_SHARED_SCENE_UNIFORMS_H
#include "shared/uniforms.h"
#ifdef __cplusplus
#include <cstddef>
#endif

UNIFORMS_BEGIN(SceneUniforms)
    ivec2 size;   // pixels of the image
    ivec2 tiles;  // tiles of 16x16 pixels
    int object_count;
    int pose_step;             // pose sets to go on by per sample; 0 = one set for all samples
    int first_sample;          // index into the sample points; 0 starts the sums anew
    int sample_count;          // of this dispatch
    uint seed;                 // of the rotation of sample points per pixel
    int rotate_samples;        // 0: every pixel uses the same sample points
    float lens_radius;         // scene units; 0 = pinhole
    float focus_distance;      // scene units
    vec4 light;                // unit vector towards the light; w = its strength
    vec4 zenith;               // color of the sky overhead; w = alpha of the background, 0 or 1
    vec4 horizon;              // color of the sky at the horizon; w = amount of clouds, 0..1
    vec4 ambient;              // light from all around, above; w = share that comes from below
    vec4 light_right;          // unit vector across the light; w = offset of the first column, in cells
    vec4 light_up;             // unit vector across both; w = offset of the first row, in cells
    vec2 light_cells;          // cells per scene unit, x and y
    int light_lists;           // where the lists of the cells begin
    int aperture_blades;       // below 3: a disc
    float aperture_rotation;   // radians, counterclockwise
    float aperture_curvature;  // of the blades, 0..1
    float aperture_ratio;      // height over width
    float barrel_per_px;       // how far the barrel's circle is moved, radii per pixel from the middle
UNIFORMS_END

#ifdef __cplusplus
namespace postchain::shared {
#endif
// One object; layout std430. Poses are apart: three rows of [rotation | position], local to world.
struct SceneObject {
    vec4 size;     // by shape, see shapes.glsl
    vec4 extra;    // rectangle: center and radius of a round hole, x y r
    vec4 color_a;  // w = radiance gain of a lamp, 0 = a lit surface
    vec4 color_b;  // second color of the pattern; w = strength of the gloss
    vec4 pattern;  // x kind, y cell size in scene units, z w by kind, see surface.glsl
    vec4 flags;    // x shape, y alpha, z w unused
};
#ifdef __cplusplus
static_assert(sizeof(SceneUniforms) == 176, "std140 layout of SceneUniforms");
static_assert(offsetof(SceneUniforms, light) == 48, "std140 layout of SceneUniforms");
static_assert(sizeof(SceneObject) == 96, "std430 layout of SceneObject");
}  // namespace postchain::shared
#endif

// Shapes, in the order of the tile lists.
#define SCENE_RECTANGLE 0
#define SCENE_SPHERE 1
#define SCENE_BOX 2
#define SCENE_ROD 3
#define SCENE_TORUS 4
#define SCENE_WHEEL 5
#define SCENE_SHAPES 6

// Patterns.
#define SCENE_PLAIN 0
#define SCENE_CHECKER 1
#define SCENE_STRIPES 2
#define SCENE_RINGS 3
#define SCENE_BRICKS 4
#define SCENE_TEXT 5
#define SCENE_WINDOWS 6
#define SCENE_TREAD 7
#define SCENE_PLAID 8
#define SCENE_TILES 9

#define SCENE_TILE 16
// Cells of the light's grid, to each side.
#define SCENE_LIGHT_GRID 64
#define SCENE_BACKGROUND_DEPTH 1e10
// Rows of a pose set: the camera's three, (focal length in pixels, 0, 0, 0), three per object.
#define SCENE_CAMERA_ROWS 4

#endif
