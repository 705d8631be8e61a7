#version 450 core
// Where a vertex is, and where it was a frame ago.
uniform mat4 world_view_projection;
uniform mat4 world;
uniform vec4 previous_x, previous_y, previous_w;  // rows of the previous world to clip matrix
uniform float flip;  // -1: OGRE draws into textures upside down, row 0 on top

in vec4 vertex;
in vec3 normal;
in vec2 uv0;
out vec2 uv;
out vec3 facing;
out vec3 here, there;  // clip space: x, y, w

void main() {
    gl_Position = world_view_projection * vertex;
    uv = uv0;
    facing = mat3(world) * normal;
    here = gl_Position.xyw;
    there = vec3(dot(previous_x, vertex), flip * dot(previous_y, vertex), dot(previous_w, vertex));
}
