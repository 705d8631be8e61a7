#version 450 core
// One dispatch adds `sample_count` rays per pixel to the sums of an image.
//
//   sample point (lens, pixel) -> ray -> tile's objects, nearest first -> surface -> sums
//                                        light's cell of the point -> in shadow?
//
// SHAPES, CASTERS, PATTERNS: bits of the kinds that the scene has.
// DISC 0: the aperture is not a disc. APERTURE_IMAGE 1: it is an image.
// BEHIND 1: without the object that the pixel's center shows, the first with alpha >= 0.5.
// VECTORS 1: also writes depth of the first surface with alpha >= 0.5 (the default pass threshold
// of Cycles), and sums its displacements; pose sets 1 and 2 then hold the previous and the next
// frame. Only the last sample's depth is kept, so depth is rendered with one sample per pixel.

layout(local_size_x = 16, local_size_y = 16) in;
#include "shared/scene_uniforms.h"

layout(std430, binding = 0) readonly buffer Poses { vec4 pose[]; };
layout(std430, binding = 1) readonly buffer Objects { SceneObject object[]; };
layout(std430, binding = 2) readonly buffer Tiles { uint tile[]; };
layout(std430, binding = 3) readonly buffer Letters { uint letters[]; };
layout(std430, binding = 4) readonly buffer SamplePoints { vec4 sample_point[]; };
layout(std430, binding = 5) buffer ColorSums { vec4 color_sum[]; };
layout(std430, binding = 6) buffer VectorSums { vec4 vector_sum[]; };
layout(std430, binding = 7) writeonly buffer Depths { float depth[]; };

#include "scenes/shapes.glsl"
#include "scenes/surface.glsl"

#if BEHIND
int left_out = -1;  // an object that rays from the camera pass through
#define IS_THERE(id) (id != left_out)
#else
#define IS_THERE(id) true
#endif

struct Hit {
    float t;
    int id;
};

int pose_rows(int rows, int id) { return rows + SCENE_CAMERA_ROWS + 3 * id; }

vec3 to_local(vec4 r0, vec4 r1, vec4 r2, vec3 v) {
    return r0.xyz * v.x + r1.xyz * v.y + r2.xyz * v.z;
}

// Objects of one shape in this cell; `test` gets the object's ray as o, d. A software renderer runs
// every loop at least once, even if empty: shapes missing in the scene are compiled out.
#define NEAREST(shape, test)                                                      \
    if ((shapes >> shape & 1) != 0)                                               \
    for (uint i = tile[base + shape], end = tile[base + shape + 1]; i < end; ++i) { \
        int id = int(tile[i]);                                                    \
        int at = pose_rows(rows, id);                                             \
        vec4 r0 = pose[at], r1 = pose[at + 1], r2 = pose[at + 2];                 \
        vec4 size = object[id].size;                                              \
        vec3 o = to_local(r0, r1, r2, from - vec3(r0.w, r1.w, r2.w));             \
        vec3 d = to_local(r0, r1, r2, direction);                                 \
        float t = test;                                                           \
        if (t < hit.t && t > beyond && IS_THERE(id)) hit = Hit(t, id);            \
    }

Hit nearest(vec3 from, vec3 direction, int rows, int base, float beyond, const int shapes) {
    Hit hit = Hit(kMiss, -1);
    NEAREST(SCENE_RECTANGLE, hit_rectangle(o, d, size, object[id].extra))
    NEAREST(SCENE_SPHERE, hit_sphere(o, d, size.x))
    NEAREST(SCENE_BOX, hit_box(o, d, size.xyz))
    NEAREST(SCENE_ROD, hit_rod(o, d, size.x, size.y))
    NEAREST(SCENE_TORUS, hit_torus(o, d, size.x, size.y))
    NEAREST(SCENE_WHEEL, hit_wheel(o, d, size))
    return hit;
}

// All rays to the light are parallel, so each stays in one cell of a grid across the light.
bool in_shadow(vec3 world, int rows) {
    vec2 at = vec2(dot(world, uniforms.light_right.xyz), dot(world, uniforms.light_up.xyz)) *
                  uniforms.light_cells + vec2(uniforms.light_right.w, uniforms.light_up.w);
    ivec2 cell = ivec2(floor(at));
    if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, ivec2(SCENE_LIGHT_GRID))))
        return false;
    int base = uniforms.light_lists + (cell.y * SCENE_LIGHT_GRID + cell.x) * (SCENE_SHAPES + 1);
#if BEHIND
    int of_camera = left_out;
    left_out = -1;
    bool shadowed = nearest(world, uniforms.light.xyz, rows, base, 0.0, CASTERS).id >= 0;
    left_out = of_camera;
    return shadowed;
#else
    return nearest(world, uniforms.light.xyz, rows, base, 0.0, CASTERS).id >= 0;
#endif
}

#if BEHIND
// The object that a ray of the first pose set shows; -1: none.
int shown_by(vec3 from, vec3 direction, int base) {
    float beyond = 0.0;
    for (int layer = 0; layer < 8; ++layer) {
        Hit hit = nearest(from, direction, 0, base, beyond, SHAPES);
        if (hit.id < 0 || object[hit.id].flags.y >= 0.5) return hit.id;
        beyond = hit.t * 1.00001;
    }
    return -1;
}
#endif

// Position of a world point in the camera of a pose set; pixels, +y up. False behind the camera.
bool project(int rows, vec3 world, out vec2 position) {
    vec4 c0 = pose[rows], c1 = pose[rows + 1], c2 = pose[rows + 2];
    vec3 seen = to_local(c0, c1, c2, world - vec3(c0.w, c1.w, c2.w));
    position = seen.xy * (pose[rows + 3].x / seen.z);
    return seen.z > 1e-3;
}

vec3 to_world(int rows, int id, vec3 local) {
    int at = pose_rows(rows, id);
    vec4 p = vec4(local, 1.0);
    return vec3(dot(pose[at], p), dot(pose[at + 1], p), dot(pose[at + 2], p));
}

// XY = position(previous) - position(this), ZW = position(this) - position(next).
vec4 displacement(int set_rows, int id, vec3 local) {
    vec2 here, before, after;
    bool seen = project(0, to_world(0, id, local), here);
    bool was = project(set_rows, to_world(set_rows, id, local), before);
    bool will = project(2 * set_rows, to_world(2 * set_rows, id, local), after);
    return vec4(seen && was ? before - here : vec2(0.0), seen && will ? here - after : vec2(0.0));
}

// Maps the unit square to the unit disc, preserving area ratios (Shirley and Chiu 1997).
vec2 on_disc(vec2 u) {
    vec2 p = 2.0 * u - 1.0;
    bool wide = abs(p.x) > abs(p.y);
    float radius = wide ? p.x : p.y;
    float ratio = wide ? p.y / p.x : p.y != 0.0 ? p.x / p.y : 0.0;
    float angle = 0.78539816339 * (wide ? ratio : 2.0 - ratio);
    return radius * vec2(cos(angle), sin(angle));
}

#if !DISC
#if APERTURE_IMAGE
// Transmittances of 0 to 1, rows from the top.
layout(binding = 0) uniform sampler2D aperture_image;
const int kTries = 4096;
#else
const int kTries = 64;
#endif

// Aperture transmittance, 0 to 1, at a point of the unit disc, for the place in the image where a
// pinhole sees the point, in pixels from the center, y up. Blades are arcs of the given curvature
// through corners on the unit circle; the barrel is a circle that appears shifted off axis.
float transmittance(vec2 lens, vec2 place) {
    vec2 beside = lens + uniforms.barrel_per_px * place;
    if (dot(beside, beside) > 1.0) return 0.0;
    float ratio = uniforms.aperture_ratio;
    vec2 at = lens / vec2(min(1.0 / ratio, 1.0), min(ratio, 1.0));
    if (dot(at, at) > 1.0) return 0.0;
#if APERTURE_IMAGE
    float c = cos(uniforms.aperture_rotation), s = sin(uniforms.aperture_rotation);
    vec2 upright = vec2(c * at.x + s * at.y, c * at.y - s * at.x);
    ivec2 size = textureSize(aperture_image, 0);
    ivec2 cell = ivec2((0.5 + vec2(0.5, -0.5) * upright) * vec2(size));
    return texelFetch(aperture_image, clamp(cell, ivec2(0), size - 1), 0).r;
#else
    if (uniforms.aperture_blades < 3) return 1.0;
    // Rotated so that the center of its blade is to the right.
    float blade = 6.28318530718 / float(uniforms.aperture_blades);
    float angle = atan(at.y, at.x) - uniforms.aperture_rotation;
    angle -= blade * floor(angle / blade + 0.5);
    at = length(at) * vec2(cos(angle), sin(angle));
    vec2 corner = vec2(cos(0.5 * blade), sin(0.5 * blade));
    // The arc, of a circle of radius 1/curvature, bulges beyond the chord by its sagitta.
    float bent = uniforms.aperture_curvature;
    float bulge = sqrt(1.0 - bent * bent * at.y * at.y) - sqrt(1.0 - bent * bent * corner.y * corner.y);
    return at.x <= corner.x + (bent > 0.0 ? bulge / bent : 0.0) ? 1.0 : 0.0;
#endif
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= uniforms.size.x || pixel.y >= uniforms.size.y) return;
    int index = pixel.y * uniforms.size.x + pixel.x;
    int base = (pixel.y / SCENE_TILE * uniforms.tiles.x + pixel.x / SCENE_TILE) * (SCENE_SHAPES + 1);
    int set_rows = SCENE_CAMERA_ROWS + 3 * uniforms.object_count;

    vec4 turn = vec4(0.0);
    if (uniforms.rotate_samples != 0) {
        uint h = hash(uint(index) ^ hash(uniforms.seed));
        turn.x = unit(h);
        turn.y = unit(h = hash(h + 1u));
        turn.z = unit(h = hash(h + 2u));
        turn.w = unit(h = hash(h + 3u));
    }
    bool first = uniforms.first_sample == 0;
    vec4 color = first ? vec4(0.0) : color_sum[index];
#if VECTORS
    vec4 vectors = first ? vec4(0.0) : vector_sum[index];
    float last_depth = SCENE_BACKGROUND_DEPTH;
#endif

#if BEHIND
    vec2 center = vec2(pixel) + 0.5 - 0.5 * vec2(uniforms.size);
    vec3 ahead = normalize(vec3(center.x, -center.y, pose[3].x));
    left_out = shown_by(vec3(pose[0].w, pose[1].w, pose[2].w),
                        vec3(dot(pose[0].xyz, ahead), dot(pose[1].xyz, ahead),
                             dot(pose[2].xyz, ahead)), base);
#endif
    for (int s = 0; s < uniforms.sample_count; ++s) {
        int rows = s * uniforms.pose_step * set_rows;
        vec4 u = fract(sample_point[uniforms.first_sample + s] + turn);
        vec4 c0 = pose[rows], c1 = pose[rows + 1], c2 = pose[rows + 2];
        float focal_px = pose[rows + 3].x;
        vec2 film = vec2(pixel) + u.zw - 0.5 * vec2(uniforms.size);
        // In camera coordinates, x right, y up, z forward: through the focused point.
        vec2 lens = on_disc(u.xy);
#if !DISC
        // Blocked lens samples are drawn again, until enough points pass some light.
        float lens_px = uniforms.lens_radius * focal_px / uniforms.focus_distance;
        uint again = hash(uint(index) ^ hash(uniforms.seed ^ hash(uint(uniforms.first_sample + s))));
        float chance = 0.0;
#if APERTURE_IMAGE
        chance = unit(again = hash(again + 1u));
#endif
        for (int i = 0; i < kTries; ++i) {
            if (transmittance(lens, vec2(film.x, -film.y) - lens_px * lens) > chance) break;
#if APERTURE_IMAGE
            chance = unit(again = hash(again + 1u));
#endif
            again = hash(again + 1u);
            float x = unit(again);
            again = hash(again + 1u);
            lens = on_disc(vec2(x, unit(again)));
        }
#endif
        lens *= uniforms.lens_radius;
        vec3 focus = vec3(film.x, -film.y, focal_px) * (uniforms.focus_distance / focal_px);
        vec3 seen = normalize(focus - vec3(lens, 0.0));
        vec3 direction = vec3(dot(c0.xyz, seen), dot(c1.xyz, seen), dot(c2.xyz, seen));
        vec3 from = vec3(c0.w, c1.w, c2.w) + lens.x * vec3(c0.x, c1.x, c2.x) +
                    lens.y * vec3(c0.y, c1.y, c2.y);

        vec3 sum = vec3(0.0);
        float through = 1.0;
        float beyond = 0.0;
        bool measured = false;
        for (int layer = 0; layer < 8; ++layer) {
            Hit hit = nearest(from, direction, rows, base, beyond, SHAPES);
            if (hit.id < 0) {
                sum += through * uniforms.zenith.w * sky_color(direction);
                through *= 1.0 - uniforms.zenith.w;
                break;
            }
            int at = pose_rows(rows, hit.id);
            vec4 r0 = pose[at], r1 = pose[at + 1], r2 = pose[at + 2];
            vec3 world = from + hit.t * direction;
            vec3 local = to_local(r0, r1, r2, world - vec3(r0.w, r1.w, r2.w));
            SceneObject seen_object = object[hit.id];
            int shape = int(seen_object.flags.x);
            vec3 n = normal_of(shape, local, seen_object.size);
            vec3 normal = vec3(dot(r0.xyz, n), dot(r1.xyz, n), dot(r2.xyz, n));
            if (dot(normal, direction) > 0.0) normal = -normal;
            float light = 0.0;
            if (dot(normal, uniforms.light.xyz) > 0.0 && seen_object.color_a.w == 0.0)
                light = in_shadow(world + 2e-4 * hit.t * normal, rows) ? 0.0 : 1.0;
            float alpha = seen_object.flags.y;
            Surface surface = surface_of(seen_object, local, n);
            sum += through * alpha * radiance(surface, normal, -direction, light);
            through *= 1.0 - alpha;
#if VECTORS
            if (!measured && alpha >= 0.5) {
                measured = true;
                vectors += displacement(set_rows, hit.id, local);
                last_depth = dot(world - vec3(c0.w, c1.w, c2.w), vec3(c0.z, c1.z, c2.z));
            }
#endif
            if (through == 0.0) break;
            // Only the front of a solid is hit, so that no surface is hit twice.
            beyond = hit.t * 1.00001;
        }
        color += vec4(sum, 1.0 - through);
    }
    color_sum[index] = color;
#if VECTORS
    vector_sum[index] = vectors;
    depth[index] = last_depth;
#endif
}
