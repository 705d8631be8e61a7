// Shading of surfaces and sky: procedural patterns and a simple light.
//
// Patterns of rectangles and wheels use their own x, y, those of solids their own x, y, z, so that
// they move with the object. All noise comes from integer hashes, so that every run gives the same
// bits.

uint hash(uint x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

float unit(uint x) { return float(x >> 8) * (1.0 / 16777216.0); }

float hash_cell(ivec2 cell, uint salt) {
    return unit(hash(uint(cell.x) * 0x9e3779b9u ^ hash(uint(cell.y) + salt * 0x85ebca6bu)));
}

float value_noise(vec2 p, uint salt) {
    vec2 base = floor(p);
    vec2 f = p - base;
    f = f * f * (3.0 - 2.0 * f);
    ivec2 c = ivec2(base);
    return mix(mix(hash_cell(c, salt), hash_cell(c + ivec2(1, 0), salt), f.x),
               mix(hash_cell(c + ivec2(0, 1), salt), hash_cell(c + ivec2(1, 1), salt), f.x), f.y);
}

// Color of the sky in direction d (unit); clouds thin out at the horizon.
vec3 sky_color(vec3 d) {
    float up = clamp(d.y, 0.0, 1.0);
    vec3 color = mix(uniforms.horizon.rgb, uniforms.zenith.rgb, sqrt(up));
    vec2 plane = d.xz / (up + 0.25) * 3.0;
    float cloud = 0.5 * value_noise(plane, 7u) + 0.3 * value_noise(plane * 2.3, 8u) +
                  0.2 * value_noise(plane * 5.1, 9u);
    cloud = smoothstep(0.45, 0.75, cloud) * smoothstep(0.0, 0.2, d.y) * uniforms.horizon.w;
    return mix(color, vec3(1.1, 1.08, 1.05), cloud);
}

// Letters are columns of 7 bits, one uint each; pattern.z = first column, pattern.w = columns per
// line, extra.w = lines.
float text_mask(SceneObject object, vec2 p) {
    vec2 uv = vec2(0.5, 0.5) + 0.5 * p * vec2(1.0, -1.0) / (object.size.xy * 0.9);
    float lines = object.extra.w;
    float row = uv.y * lines * 9.0;
    int line = int(floor(row / 9.0));
    int bit = int(floor(row - 9.0 * float(line))) - 1;
    int column = int(floor(uv.x * object.pattern.w));
    bool inside = uv.x >= 0.0 && uv.x < 1.0 && uv.y >= 0.0 && uv.y < 1.0 && bit >= 0 && bit < 7;
    if (!inside) return 0.0;
    int at = int(object.pattern.z) + line * int(object.pattern.w) + column;
    return float((letters[at] >> bit) & 1u);
}

// Patterns missing in the scene are compiled out.
bool is(int kind, const int pattern) { return (PATTERNS >> pattern & 1) != 0 && kind == pattern; }

struct Surface {
    vec3 albedo;
    vec3 emitted;
    float gloss;
};

// `p` is in the object's coordinates, `n` its normal there.
Surface surface_of(SceneObject object, vec3 p, vec3 n) {
    int kind = int(object.pattern.x);
    float cell = object.pattern.y;
    vec3 a = object.color_a.rgb, b = object.color_b.rgb;
    Surface s = Surface(a, vec3(0.0), object.color_b.w);
    // Flat patterns cover each face of a box.
    vec2 flat_p = p.xy;
    if (int(object.flags.x) == SCENE_BOX)
        flat_p = abs(n.x) > 0.5 ? p.zy : abs(n.y) > 0.5 ? p.xz : p.xy;
    if (is(kind, SCENE_CHECKER)) {
        // Keeps faces off cell borders: boxes end on whole cells, rectangles are at z = 0.
        ivec3 c = ivec3(floor(0.999 * p / cell + vec3(0.0, 0.0, 0.5)));
        s.albedo = ((c.x + c.y + c.z) & 1) == 0 ? a : b;
    } else if (is(kind, SCENE_STRIPES)) {
        float along = dot(flat_p, object.pattern.zw);
        s.albedo = fract(along / cell) < 0.5 ? a : b;
    } else if (is(kind, SCENE_RINGS)) {
        s.albedo = fract(length(p.xy) / cell) < 0.5 ? a : b;
    } else if (is(kind, SCENE_BRICKS)) {
        vec2 q = flat_p / vec2(2.6 * cell, cell);
        float row = floor(q.y);
        q.x += 0.5 * mod(row, 2.0);
        ivec2 brick = ivec2(floor(q.x), int(row));
        vec2 inside = fract(q);
        vec2 edge = min(inside, 1.0 - inside) * vec2(2.6, 1.0);
        float mortar = 1.0 - smoothstep(0.06, 0.10, min(edge.x, edge.y));
        vec3 tint = a * (0.55 + 0.75 * hash_cell(brick, 1u));
        tint = mix(tint, tint.grr * vec3(1.3, 0.55, 0.4), 0.3 * hash_cell(brick, 2u));
        float grain = 0.75 + 0.5 * value_noise(flat_p / (0.18 * cell), 3u);
        float dirt = 0.7 + 0.6 * value_noise(flat_p / (5.0 * cell), 4u);
        s.albedo = mix(tint * grain, b, mortar) * dirt;
    } else if (is(kind, SCENE_TEXT)) {
        vec2 edge = object.size.xy - abs(p.xy);
        float frame = min(edge.x, edge.y) < 0.06 * min(object.size.x, object.size.y) ? 1.0 : 0.0;
        s.albedo = mix(a, b, max(frame, text_mask(object, p.xy)));
    } else if (is(kind, SCENE_WINDOWS)) {
        vec2 q = flat_p / cell;
        ivec2 at = ivec2(floor(q));
        vec2 inside = fract(q);
        bool pane = inside.x > 0.24 && inside.x < 0.80 && inside.y > 0.22 && inside.y < 0.82;
        float chance = hash_cell(at, 5u + uint(object.pattern.z));
        if (pane) {
            s.albedo = b;
            s.gloss = 0.0;
            if (chance < 0.28) s.emitted = vec3(1.0, 0.78, 0.42) * (0.9 + 1.6 * chance);
            if (chance > 0.965) s.emitted = vec3(1.0, 0.93, 0.75) * object.pattern.w;
        } else {
            s.albedo *= 0.85 + 0.3 * hash_cell(ivec2(0, at.y), 6u);
        }
    } else if (is(kind, SCENE_TREAD)) {
        float around = atan(p.y, p.x) * (0.15915494309 * cell);
        float side = p.z / object.size.y;
        float lane = floor(side * 2.5 + 0.5);
        bool groove = fract(around + 0.5 * lane) < 0.42 && abs(side) < 0.95;
        s.albedo = groove ? b : a;
        s.gloss *= groove ? 0.1 : 1.0;
    } else if (is(kind, SCENE_PLAID)) {
        vec2 q = fract(flat_p / cell);
        vec3 warp = q.x < 0.5 ? a : b;
        vec3 weft = q.y < 0.5 ? a : b;
        s.albedo = 0.5 * (warp + weft);
        if (abs(q.x - 0.5) < 0.06 || abs(q.y - 0.5) < 0.06) s.albedo = vec3(0.9, 0.72, 0.2);
    } else if (is(kind, SCENE_TILES)) {
        vec2 q = flat_p / cell;
        ivec2 at = ivec2(floor(q));
        vec2 edge = min(fract(q), 1.0 - fract(q));
        s.albedo = ((at.x + at.y) & 1) == 0 ? a : b;
        s.albedo *= 0.8 + 0.4 * hash_cell(at, 10u);
        if (min(edge.x, edge.y) < 0.03) s.albedo *= 0.35;
    }
    s.emitted += object.color_a.rgb * object.color_a.w;
    if (object.color_a.w > 0.0) s.albedo = vec3(0.0);
    return s;
}

// Radiance towards the camera. `toward` is the unit vector from the surface to the camera,
// `normal` faces it.
vec3 radiance(Surface s, vec3 normal, vec3 toward, float light) {
    float facing = dot(normal, uniforms.light.xyz);
    float diffuse = max(facing, 0.0) * uniforms.light.w * light;
    float above = 0.5 + 0.5 * normal.y;
    vec3 around = uniforms.ambient.rgb * mix(uniforms.ambient.w, 1.0, above);
    vec3 middle = normalize(uniforms.light.xyz + toward);
    float shine = max(dot(normal, middle), 0.0);
    shine *= shine; shine *= shine; shine *= shine; shine *= shine; shine *= shine; shine *= shine;
    float grazing = 1.0 - max(dot(normal, toward), 0.0);
    grazing *= grazing; grazing *= grazing;
    vec3 mirrored = mix(uniforms.horizon.rgb, uniforms.zenith.rgb, above) * (0.04 + 0.5 * grazing);
    return s.albedo * (around + vec3(1.0, 0.95, 0.88) * diffuse) +
           s.gloss * (vec3(2.2 * light * uniforms.light.w * shine * step(0.0, facing)) +
                      0.6 * mirrored) + s.emitted;
}
