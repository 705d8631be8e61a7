// Colors as they are compared: c/(c + level), from 0 to 1, where the level is a multiple of the
// brightness around. So the exposure of a frame changes no decision.

const int kAround3x3 = 9;  // places whose brightness is averaged

// Mean of the roots of red, green and blue, of which one lamp does not make much.
float mean_root(vec3 c) {
    precise const vec3 root = sqrt(max(c, vec3(0.0)));
    precise const float mean = (root.r + root.g + root.b) / 3.0;
    return mean;
}

// So many times the brightness, from the sum of the mean roots of all places.
float level_of(float roots, float times) {
    precise const float mean = roots / float(kAround3x3);
    precise const float level = max(times * mean * mean, 1e-30);
    return level;
}

vec3 as_part_of(vec3 c, float level) {
    precise const vec3 part = c / (level + abs(c));
    return part;
}
