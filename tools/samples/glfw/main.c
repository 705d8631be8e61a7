/* A sample host: a GLFW window, a scene with three textures, and the chain between the scene and the
 * screen.
 *
 *   scene -> color, velocity, depth -> pc_run() -> output -> window
 *
 * glfw_host [FRAMES [IMAGE.ppm]]: ends after FRAMES frames (0 = when the window is closed), and
 * writes the last one. Also builds on its own: CMakeLists.txt. */
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <math.h>
#include <postchain/postchain.h>
#include <stdio.h>
#include <stdlib.h>

enum { WIDTH = 640, HEIGHT = 360 };

/* A spinning striped bar in front of a wall. Every vertex has its position in this frame and in the
 * previous one. Their difference, in normalized device coordinates, is the velocity. */
static const char *VERTEX_SHADER =
    "#version 450 core\n"
    "uniform float now, before;\n"
    "uniform int thing;\n"
    "out vec2 at;\n"
    "out vec4 here, there;\n"
    "vec4 place(vec2 p, float turn) {\n"
    "    float c = cos(turn), s = sin(turn), d = thing == 0 ? 12.0 : 4.0;\n"
    "    vec2 q = thing == 0 ? p * 16.0 : mat2(c, s, -s, c) * (p * vec2(2.4, 0.35));\n"
    "    return vec4(q.x * 9.0 / 16.0 * 1.5, q.y * 1.5, d - 0.2, d);\n" /* near 0.1, no far */
    "}\n"
    "void main() {\n"
    "    at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;\n"
    "    here = place(at, now);\n"
    "    there = place(at, before);\n"
    "    gl_Position = here;\n"
    "}\n";
static const char *FRAGMENT_SHADER =
    "#version 450 core\n"
    "uniform int thing;\n"
    "in vec2 at;\n"
    "in vec4 here, there;\n"
    "layout(location = 0) out vec4 color;\n"
    "layout(location = 1) out vec2 velocity;\n"
    "void main() {\n"
    "    vec2 cell = floor(at * (thing == 0 ? vec2(16.0, 9.0) : vec2(8.0, 1.0)));\n"
    "    float light = mod(cell.x + cell.y, 2.0);\n"
    "    vec3 wall = mix(vec3(0.05, 0.08, 0.12), vec3(0.15, 0.2, 0.25), light);\n"
    "    color = vec4(thing == 0 ? wall : mix(vec3(0.9, 0.3, 0.1), vec3(1.0, 0.9, 0.6), light), 1.0);\n"
    "    velocity = here.xy / here.w - there.xy / there.w;\n"
    "}\n";

static void fail(const char *what, const char *why) {
    fprintf(stderr, "%s: %s\n", what, why);
    exit(1);
}

static GLuint make_program(void) {
    const GLuint program = glCreateProgram();
    const char *sources[] = {VERTEX_SHADER, FRAGMENT_SHADER};
    const GLenum kinds[] = {GL_VERTEX_SHADER, GL_FRAGMENT_SHADER};
    GLint good = 0;
    for (int i = 0; i < 2; ++i) {
        const GLuint shader = glCreateShader(kinds[i]);
        glShaderSource(shader, 1, &sources[i], NULL);
        glCompileShader(shader);
        glAttachShader(program, shader);
        glDeleteShader(shader);
    }
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &good);
    if (!good) fail("scene", "its program does not link");
    return program;
}

static pc_texture make_texture(GLenum format) {
    pc_texture texture = {.internal_format = format, .width = WIDTH, .height = HEIGHT};
    glCreateTextures(GL_TEXTURE_2D, 1, &texture.name);
    glTextureStorage2D(texture.name, 1, format, WIDTH, HEIGHT);
    return texture;
}

static GLuint make_framebuffer(pc_texture color, pc_texture velocity, pc_texture depth) {
    const GLenum buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    GLuint framebuffer;
    glCreateFramebuffers(1, &framebuffer);
    glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, color.name, 0);
    if (velocity.name) {
        glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT1, velocity.name, 0);
        glNamedFramebufferTexture(framebuffer, GL_DEPTH_ATTACHMENT, depth.name, 0);
        glNamedFramebufferDrawBuffers(framebuffer, 2, buffers);
    }
    return framebuffer;
}

static void draw_scene(GLuint program, GLuint framebuffer, float now, float before) {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, WIDTH, HEIGHT);
    glEnable(GL_DEPTH_TEST);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(program);
    glUniform1f(glGetUniformLocation(program, "now"), now);
    glUniform1f(glGetUniformLocation(program, "before"), before);
    for (int thing = 0; thing < 2; ++thing) {
        glUniform1i(glGetUniformLocation(program, "thing"), thing);
        glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    }
}

static void write_picture(const char *path) {
    static unsigned char pixels[WIDTH * HEIGHT * 3];
    FILE *file = fopen(path, "wb");
    if (!file) fail(path, "cannot be written");
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, WIDTH, HEIGHT, GL_RGB, GL_UNSIGNED_BYTE, pixels);
    fprintf(file, "P6 %d %d 255\n", WIDTH, HEIGHT);
    for (int y = HEIGHT - 1; y >= 0; --y) fwrite(pixels + y * WIDTH * 3, 3, WIDTH, file);
    fclose(file);
}

int main(int count, char **arguments) {
    const int frames = count > 1 ? atoi(arguments[1]) : 0;
    if (!glfwInit()) fail("GLFW", "there is no display");
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
    GLFWwindow *window = glfwCreateWindow(WIDTH, HEIGHT, "postchain in a GLFW host", NULL, NULL);
    if (!window) fail("GLFW", "there is no OpenGL 4.5");
    glfwMakeContextCurrent(window);

    const pc_texture color = make_texture(GL_RGBA16F), velocity = make_texture(GL_RG16F);
    const pc_texture depth = make_texture(GL_DEPTH_COMPONENT32F), output = make_texture(GL_RGBA8);
    const GLuint scene = make_framebuffer(color, velocity, depth);
    const GLuint screen = make_framebuffer(output, (pc_texture){0}, (pc_texture){0});
    const GLuint program = make_program();
    GLuint vertices;
    glCreateVertexArrays(1, &vertices);
    glBindVertexArray(vertices);

    /* 1. An instance on this context, a chain, and a frame that describes the textures. */
    pc_instance *instance;
    pc_chain *chain;
    pc_create_info info = {.struct_size = sizeof(info), .api_version = PC_API_VERSION};
    if (pc_create(&info, &instance) != PC_OK) fail("postchain", pc_error());
    if (pc_chain_create("motion_blur,fxaa", &chain) != PC_OK) fail("postchain", pc_error());
    pc_frame frame = {.struct_size = sizeof(frame)};
    frame.color = color;
    frame.depth = depth;
    frame.motion = velocity;
    frame.output = output;
    frame.depth_encoding = PC_DEPTH_FORWARD_INFINITE;
    frame.near_clip = 0.1f;
    frame.motion_scale[0] = WIDTH / 2.0f; /* normalized device coordinates to pixels */
    frame.motion_scale[1] = HEIGHT / 2.0f;
    frame.shutter_frames = 0.5f;
    frame.barriers = GL_FRAMEBUFFER_BARRIER_BIT; /* output is read by a blit */
    /* 2. Compiles all programs here rather than in a frame. */
    if (pc_prepare(instance, chain, &frame, 1) != PC_OK) fail("postchain", pc_last_error(instance));

    for (int i = 0; (frames == 0 || i < frames) && !glfwWindowShouldClose(window); ++i) {
        draw_scene(program, scene, 0.25f * (float)i, 0.25f * (float)(i - 1));
        /* 3. Every frame. If it fails, the unfiltered color is shown. */
        frame.frame_number = (uint64_t)i;
        if (i == 0)
            frame.flags |= PC_CAMERA_CUT;
        else
            frame.flags &= ~(uint32_t)PC_CAMERA_CUT;
        if (pc_run(instance, chain, &frame, NULL) != PC_OK)
            fail("postchain", pc_last_error(instance));
        glBlitNamedFramebuffer(screen, 0, 0, 0, WIDTH, HEIGHT, 0, 0, WIDTH, HEIGHT,
                               GL_COLOR_BUFFER_BIT, GL_NEAREST);
        if (i + 1 == frames && count > 2) {
            glBindFramebuffer(GL_FRAMEBUFFER, 0);
            write_picture(arguments[2]);
        }
        glfwSwapBuffers(window);
        glfwPollEvents();
    }
    pc_chain_destroy(chain);
    pc_destroy(instance);
    glfwTerminate();
    return 0;
}
