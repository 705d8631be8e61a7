#version 450 core
// Scene-linear color and velocity. Depth is the depth buffer's.
uniform sampler2D image;
uniform float glow;  // 0: lit; else the surface shines, so bright
uniform float held;  // 1: the surface of what the camera carries

in vec2 uv;
in vec3 facing;
in vec3 here, there;
layout(location = 0) out vec4 color;
layout(location = 1) out vec2 velocity;  // this frame minus previous, in normalized device coordinates
layout(location = 2) out float mask;

void main() {
    float light = 0.45 + 0.75 * max(dot(normalize(facing), normalize(vec3(0.4, 0.7, 0.6))), 0.0);
    vec3 surface = texture(image, uv).rgb;
    color = vec4(glow > 0.0 ? glow * vec3(1.0, 0.8, 0.5) : light * surface, 1.0);
    mask = held;
    velocity = here.xy / here.z - there.xy / there.z;
}
