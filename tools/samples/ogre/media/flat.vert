#version 450 core
uniform mat4 world_view_projection;
in vec4 vertex;
in vec2 uv0;
in vec4 colour;
out vec2 uv;
out vec4 tint;

void main() {
    gl_Position = world_view_projection * vertex;
    uv = uv0;
    tint = colour;
}
