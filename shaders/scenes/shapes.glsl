// Nearest intersection of a ray with each shape, in the shape's coordinates.
//
// All take origin o and unit direction d and return the distance along d, or kMiss if there is no
// intersection in front of the origin. Closed forms (linear or quadratic), except for the torus,
// which follows its exact distance function: a float quartic fails for rays along the axis, the
// usual view of a wheel.
//
//   rectangle  size.xy half extents in z = 0; extra.xy, z: center and radius of a round hole
//   sphere     size.x radius
//   box        size.xyz half extents
//   rod        size.x half length along y without the round ends, size.y radius
//   torus      size.x radius of the ring about z, size.y radius of the tube
//   wheel      flat in z = 0: size.x outer radius, size.y hub radius, size.z number of spokes,
//              size.w half width of a spoke; the rim is 1.5 spokes wide, with a second ring
//              at 0.84

const float kMiss = 1e30;

float hit_rectangle(vec3 o, vec3 d, vec4 size, vec4 extra) {
    float t = -o.z / d.z;
    vec2 p = o.xy + t * d.xy;
    bool inside = abs(p.x) <= size.x && abs(p.y) <= size.y &&
                  distance(p, extra.xy) >= extra.z;
    return t > 0.0 && inside ? t : kMiss;
}

float hit_sphere(vec3 o, vec3 d, float radius) {
    // Starts at the foot of the perpendicular: o*o - r*r would cancel for small, far spheres.
    float along = dot(o, d);
    vec3 foot = o - along * d;
    float h = radius * radius - dot(foot, foot);
    float t = -along - sqrt(max(h, 0.0));
    return h >= 0.0 && t > 0.0 ? t : kMiss;
}

float hit_box(vec3 o, vec3 d, vec3 half_size) {
    vec3 middle = -o / d;
    vec3 reach = abs(half_size / d);
    vec3 near = middle - reach, far = middle + reach;
    float enter = max(max(near.x, near.y), near.z);
    float leave = min(min(far.x, far.y), far.z);
    return enter <= leave && enter > 0.0 ? enter : kMiss;
}

float hit_rod(vec3 o, vec3 d, float half_length, float radius) {
    // Side: a quadratic in the x-z plane; beyond the half length, the sphere of the end.
    float a = max(dot(d.xz, d.xz), 1e-12);
    float along = dot(o.xz, d.xz) / a;
    vec2 foot = o.xz - along * d.xz;
    float h = radius * radius - dot(foot, foot);
    float t = -along - sqrt(max(h, 0.0) / a);
    float y = o.y + t * d.y;
    bool side = h >= 0.0 && abs(y) <= half_length;
    if (side) return t > 0.0 ? t : kMiss;
    float top = hit_sphere(o - vec3(0.0, half_length, 0.0), d, radius);
    float bottom = hit_sphere(o + vec3(0.0, half_length, 0.0), d, radius);
    return min(top, bottom);
}

float hit_torus(vec3 o, vec3 d, float ring, float tube) {
    // Starts at the entry into the slab |z| <= tube and the bounding sphere.
    float along = dot(o, d);
    vec3 foot = o - along * d;
    float outer = ring + tube;
    float h = outer * outer - dot(foot, foot);
    if (h < 0.0) return kMiss;
    float reach = sqrt(h);
    float dz = abs(d.z) < 1e-6 ? 1e-6 : d.z;
    float slab = -o.z / dz, thick = abs(tube / dz);
    float t = max(max(-along - reach, slab - thick), 0.0);
    float end = min(-along + reach, slab + thick);
    if (t > end) return kMiss;
    float close = 2e-5 * outer;
    float gap = 0.0;
    for (int i = 0; i < 48; ++i) {
        vec3 p = o + t * d;
        gap = length(vec2(length(p.xy) - ring, p.z)) - tube;
        if (gap < close) break;
        t += gap;
        if (t > end) break;
    }
    return gap < close && t > 0.0 ? t : kMiss;
}

// Signed offsets across the parts of a wheel at point p, each in -1..1 over its width:
// x radial across rim or ring, y across the spoke, z 1 - (distance / hub radius). w: 1 = material.
vec4 wheel_parts(vec2 p, vec4 size) {
    float radius = length(p);
    float width = size.w;
    float sector = 6.28318530718 / size.z;
    float angle = atan(p.y, p.x);
    float fold = (fract(angle / sector) - 0.5) * sector;
    float across = radius * sin(fold) / width;
    float rim = (radius - (size.x - 1.5 * width)) / (1.5 * width);
    float ring = (radius - 0.84 * size.x) / (0.8 * width);
    float hub = 1.0 - radius / size.y;
    bool on_rim = abs(rim) <= 1.0, on_ring = abs(ring) <= 1.0, on_hub = hub >= 0.0;
    bool on_spoke = abs(across) <= 1.0 && radius < size.x;
    float radial = on_rim ? rim : on_ring ? ring : 0.0;
    bool ring_over = on_rim || on_ring;
    return vec4(radial, !ring_over && !on_hub && on_spoke ? across : 0.0, hub,
                ring_over || on_hub || on_spoke ? 1.0 : 0.0);
}

float hit_wheel(vec3 o, vec3 d, vec4 size) {
    float t = -o.z / d.z;
    vec2 p = o.xy + t * d.xy;
    return t > 0.0 && wheel_parts(p, size).w > 0.0 ? t : kMiss;
}

// Outward unit normal at a point on the shape. Flat wheels get one that appears round.
vec3 normal_of(int shape, vec3 p, vec4 size) {
    if (shape == SCENE_SPHERE) return p / size.x;
    if (shape == SCENE_BOX) {
        vec3 relative = abs(p) / size.xyz;
        float largest = max(max(relative.x, relative.y), relative.z);
        // Two faces meet at an edge, three at a corner: the normalized mean of their normals.
        return normalize(sign(p) * vec3(greaterThanEqual(relative, vec3(largest))));
    }
    if (shape == SCENE_ROD) return (p - vec3(0.0, clamp(p.y, -size.x, size.x), 0.0)) / size.y;
    if (shape == SCENE_TORUS) {
        vec2 center = p.xy * (size.x / length(p.xy));
        return normalize(p - vec3(center, 0.0));
    }
    if (shape == SCENE_WHEEL) {
        vec4 parts = wheel_parts(p.xy, size);
        float radius = max(length(p.xy), 1e-6);
        vec2 outward = p.xy / radius;
        float sector = 6.28318530718 / size.z;
        float middle = (floor(atan(p.y, p.x) / sector) + 0.5) * sector;
        vec2 across = vec2(-sin(middle), cos(middle));
        vec2 tilt = parts.x * outward + parts.y * across;
        if (parts.z >= 0.0) tilt = outward * (1.0 - parts.z) * 0.9;
        return normalize(vec3(tilt, sqrt(max(1.0 - dot(tilt, tilt), 0.02))));
    }
    return vec3(0.0, 0.0, 1.0);
}
