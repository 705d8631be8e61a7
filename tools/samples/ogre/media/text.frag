#version 450 core
uniform sampler2D image;  // a font: its shape is in alpha
in vec2 uv;
in vec4 tint;
out vec4 shown;

void main() {
    shown = vec4(tint.rgb, tint.a * texture(image, uv).a);
}
