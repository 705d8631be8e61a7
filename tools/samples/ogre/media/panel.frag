#version 450 core
out vec4 shown;

void main() {
    shown = vec4(0.05, 0.07, 0.1, 1.0);
}
