#version 450 core
uniform sampler2D image;
in vec2 uv;
out vec4 shown;

void main() {
    vec3 linear = max(texture(image, uv).rgb, 0.0);
    shown = vec4(pow(linear / (1.0 + linear), vec3(1.0 / 2.2)), 1.0);
}
