// The guest leaves the host's GL state as it was.
//
// In each frame the host sets some 90 values at random (from a seed), the guest runs, and all
// values are compared. GUEST_FRAMES: number of frames, fewer for a quick look; the test runs 1000.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <random>

#include "tests/guest/host.h"

namespace postchain::test::state_test {
namespace {

constexpr int kUnits = 16, kImages = 8;

int frames() {
    const char* text = std::getenv("GUEST_FRAMES");
    return text ? std::atoi(text) : 1000;
}

using State = std::map<std::string, std::vector<double>>;

// All state that a host may set, by name.
State read_state() {
    State state;
    const auto number = [&](const std::string& name, GLenum what, size_t count = 1) {
        std::vector<GLdouble> values(count);
        glGetDoublev(what, values.data());
        state[name] = {values.begin(), values.end()};
    };
    const auto indexed = [&](const std::string& name, GLenum what, GLuint index) {
        GLint64 value = 0;
        glGetInteger64i_v(what, index, &value);
        state[name + " " + std::to_string(index)] = {double(value)};
    };
    number("program", GL_CURRENT_PROGRAM);
    number("pipeline", GL_PROGRAM_PIPELINE_BINDING);
    number("vertex array", GL_VERTEX_ARRAY_BINDING);
    number("array buffer", GL_ARRAY_BUFFER_BINDING);
    number("draw framebuffer", GL_DRAW_FRAMEBUFFER_BINDING);
    number("read framebuffer", GL_READ_FRAMEBUFFER_BINDING);
    number("renderbuffer", GL_RENDERBUFFER_BINDING);
    number("uniform buffer", GL_UNIFORM_BUFFER_BINDING);
    number("storage buffer", GL_SHADER_STORAGE_BUFFER_BINDING);
    number("atomic buffer", GL_ATOMIC_COUNTER_BUFFER_BINDING);
    number("dispatch buffer", GL_DISPATCH_INDIRECT_BUFFER_BINDING);
    number("draw indirect buffer", GL_DRAW_INDIRECT_BUFFER_BINDING);
    number("copy read buffer", GL_COPY_READ_BUFFER_BINDING);
    number("copy write buffer", GL_COPY_WRITE_BUFFER_BINDING);
    number("query buffer", GL_QUERY_BUFFER_BINDING);
    number("pack buffer", GL_PIXEL_PACK_BUFFER_BINDING);
    number("unpack buffer", GL_PIXEL_UNPACK_BUFFER_BINDING);
    number("texture buffer", GL_TEXTURE_BUFFER_BINDING);
    for (const auto& [name, what] :
         std::map<std::string, GLenum>{{"pack alignment", GL_PACK_ALIGNMENT},
                                       {"pack row length", GL_PACK_ROW_LENGTH},
                                       {"pack skip rows", GL_PACK_SKIP_ROWS},
                                       {"unpack alignment", GL_UNPACK_ALIGNMENT},
                                       {"unpack row length", GL_UNPACK_ROW_LENGTH},
                                       {"unpack skip pixels", GL_UNPACK_SKIP_PIXELS},
                                       {"unpack swap bytes", GL_UNPACK_SWAP_BYTES},
                                       {"depth function", GL_DEPTH_FUNC},
                                       {"depth mask", GL_DEPTH_WRITEMASK},
                                       {"clear depth", GL_DEPTH_CLEAR_VALUE},
                                       {"cull face", GL_CULL_FACE_MODE},
                                       {"front face", GL_FRONT_FACE},
                                       {"logic operation", GL_LOGIC_OP_MODE},
                                       {"line width", GL_LINE_WIDTH},
                                       {"point size", GL_POINT_SIZE},
                                       {"blend source", GL_BLEND_SRC_RGB},
                                       {"blend target", GL_BLEND_DST_RGB},
                                       {"blend equation", GL_BLEND_EQUATION_RGB},
                                       {"stencil function", GL_STENCIL_FUNC},
                                       {"stencil reference", GL_STENCIL_REF},
                                       {"stencil mask", GL_STENCIL_WRITEMASK},
                                       {"sample coverage", GL_SAMPLE_COVERAGE_VALUE},
                                       {"polygon offset", GL_POLYGON_OFFSET_FACTOR},
                                       {"provoking vertex", GL_PROVOKING_VERTEX},
                                       {"restart index", GL_PRIMITIVE_RESTART_INDEX}})
        number(name, what);
    number("viewport", GL_VIEWPORT, 4);
    number("scissor box", GL_SCISSOR_BOX, 4);
    number("clear color", GL_COLOR_CLEAR_VALUE, 4);
    number("blend color", GL_BLEND_COLOR, 4);
    number("depth range", GL_DEPTH_RANGE, 2);
    number("color mask", GL_COLOR_WRITEMASK, 4);
    for (const auto& [name, what] :
         std::map<std::string, GLenum>{{"blend", GL_BLEND},
                                       {"cull", GL_CULL_FACE},
                                       {"depth test", GL_DEPTH_TEST},
                                       {"dither", GL_DITHER},
                                       {"scissor", GL_SCISSOR_TEST},
                                       {"stencil", GL_STENCIL_TEST},
                                       {"sRGB", GL_FRAMEBUFFER_SRGB},
                                       {"multisample", GL_MULTISAMPLE},
                                       {"polygon fill offset", GL_POLYGON_OFFSET_FILL},
                                       {"discard", GL_RASTERIZER_DISCARD},
                                       {"depth clamp", GL_DEPTH_CLAMP},
                                       {"restart", GL_PRIMITIVE_RESTART},
                                       {"seamless", GL_TEXTURE_CUBE_MAP_SEAMLESS},
                                       {"program point size", GL_PROGRAM_POINT_SIZE}})
        state[name] = {double(glIsEnabled(what))};
    for (GLuint i = 0; i < 4; ++i) {
        indexed("uniform buffer", GL_UNIFORM_BUFFER_BINDING, i);
        indexed("uniform start", GL_UNIFORM_BUFFER_START, i);
        indexed("uniform size", GL_UNIFORM_BUFFER_SIZE, i);
        indexed("storage buffer", GL_SHADER_STORAGE_BUFFER_BINDING, i);
        indexed("storage start", GL_SHADER_STORAGE_BUFFER_START, i);
        indexed("storage size", GL_SHADER_STORAGE_BUFFER_SIZE, i);
    }
    for (GLuint i = 0; i < kImages; ++i) {
        indexed("image", GL_IMAGE_BINDING_NAME, i);
        indexed("image level", GL_IMAGE_BINDING_LEVEL, i);
        indexed("image layered", GL_IMAGE_BINDING_LAYERED, i);
        indexed("image layer", GL_IMAGE_BINDING_LAYER, i);
        indexed("image access", GL_IMAGE_BINDING_ACCESS, i);
        indexed("image format", GL_IMAGE_BINDING_FORMAT, i);
    }
    number("active texture", GL_ACTIVE_TEXTURE);
    const auto active = GLenum(state["active texture"][0]);
    for (GLuint i = 0; i < kUnits; ++i) {
        glActiveTexture(GL_TEXTURE0 + i);
        const std::string unit = " " + std::to_string(i);
        number("texture" + unit, GL_TEXTURE_BINDING_2D);
        number("array texture" + unit, GL_TEXTURE_BINDING_2D_ARRAY);
        number("cube texture" + unit, GL_TEXTURE_BINDING_CUBE_MAP);
        number("sampler" + unit, GL_SAMPLER_BINDING);
    }
    glActiveTexture(active);
    return state;
}

// Objects to bind, and setters that draw their values.
class Hostile {
  public:
    explicit Hostile(uint32_t seed) : random_(seed) {
        glCreateBuffers(GLsizei(buffers_.size()), buffers_.data());
        for (GLuint buffer : buffers_) glNamedBufferStorage(buffer, 4096, nullptr, 0);
        glCreateTextures(GL_TEXTURE_2D, GLsizei(textures_.size()), textures_.data());
        for (GLuint texture : textures_) glTextureStorage2D(texture, 3, GL_RGBA8, 8, 8);
        glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &array_);
        glTextureStorage3D(array_, 1, GL_RGBA8, 4, 4, 3);
        glCreateTextures(GL_TEXTURE_CUBE_MAP, 1, &cube_);
        glTextureStorage2D(cube_, 1, GL_RGBA8, 4, 4);
        glCreateSamplers(GLsizei(samplers_.size()), samplers_.data());
        glCreateVertexArrays(1, &vertices_);
        glCreateFramebuffers(1, &framebuffer_);
        glCreateRenderbuffers(1, &renderbuffer_);
        const char* source = "#version 450 core\nlayout(local_size_x = 1) in; void main() {}\n";
        program_ = glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &source);
        glGenProgramPipelines(1, &pipeline_);
        glBindProgramPipeline(pipeline_);
        // Earlier calls must not have set GL's error flag.
        EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    }
    ~Hostile() {
        settle();
        glDeleteBuffers(GLsizei(buffers_.size()), buffers_.data());
        glDeleteTextures(GLsizei(textures_.size()), textures_.data());
        glDeleteTextures(1, &array_);
        glDeleteTextures(1, &cube_);
        glDeleteSamplers(GLsizei(samplers_.size()), samplers_.data());
        glDeleteVertexArrays(1, &vertices_);
        glDeleteFramebuffers(1, &framebuffer_);
        glDeleteRenderbuffers(1, &renderbuffer_);
        glDeleteProgram(program_);
        glDeleteProgramPipelines(1, &pipeline_);
    }
    Hostile(const Hostile&) = delete;
    Hostile& operator=(const Hostile&) = delete;

    // Sets all values; returns their number.
    int set() {
        int count = 0;
        const auto toggle = [&](GLenum what) {
            coin() ? glEnable(what) : glDisable(what);
            ++count;
        };
        for (const GLenum what :
             {GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_DITHER, GL_SCISSOR_TEST, GL_STENCIL_TEST,
              GL_FRAMEBUFFER_SRGB, GL_MULTISAMPLE, GL_POLYGON_OFFSET_FILL, GL_RASTERIZER_DISCARD,
              GL_DEPTH_CLAMP, GL_PRIMITIVE_RESTART, GL_TEXTURE_CUBE_MAP_SEAMLESS,
              GL_PROGRAM_POINT_SIZE})
            toggle(what);
        glUseProgram(coin() ? program_ : 0);
        glBindProgramPipeline(coin() ? pipeline_ : 0);
        glBindVertexArray(coin() ? vertices_ : 0);
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, coin() ? framebuffer_ : 0);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, coin() ? framebuffer_ : 0);
        glBindRenderbuffer(GL_RENDERBUFFER, coin() ? renderbuffer_ : 0);
        count += 6;
        for (GLuint i = 0; i < 4; ++i) {
            for (const GLenum target : {GL_UNIFORM_BUFFER, GL_SHADER_STORAGE_BUFFER}) {
                if (coin())
                    glBindBufferRange(target, i, buffer(), 256 * GLintptr(upto(7)), 256);
                else
                    glBindBufferBase(target, i, buffer_or_none());
                ++count;
            }
        }
        for (const GLenum target :
             {GL_ARRAY_BUFFER, GL_UNIFORM_BUFFER, GL_SHADER_STORAGE_BUFFER,
              GL_ATOMIC_COUNTER_BUFFER, GL_DISPATCH_INDIRECT_BUFFER, GL_DRAW_INDIRECT_BUFFER,
              GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, GL_QUERY_BUFFER, GL_PIXEL_PACK_BUFFER,
              GL_PIXEL_UNPACK_BUFFER, GL_TEXTURE_BUFFER}) {
            glBindBuffer(target, buffer_or_none());
            ++count;
        }
        for (GLuint i = 0; i < kUnits; ++i) {
            glActiveTexture(GL_TEXTURE0 + i);
            glBindTexture(GL_TEXTURE_2D, coin() ? textures_[upto(2)] : 0);
            glBindTexture(GL_TEXTURE_2D_ARRAY, coin() ? array_ : 0);
            glBindTexture(GL_TEXTURE_CUBE_MAP, coin() ? cube_ : 0);
            glBindSampler(i, coin() ? samplers_[upto(1)] : 0);
            count += 4;
            if (i >= kImages) continue;
            ++count;
            if (coin())
                glBindImageTexture(i, array_, 0, GLboolean(coin()), GLint(upto(2)), GL_READ_WRITE,
                                   GL_RGBA8);
            else
                glBindImageTexture(i, coin() ? textures_[upto(2)] : 0, GLint(upto(2)), GL_FALSE, 0,
                                   coin() ? GL_READ_ONLY : GL_WRITE_ONLY, GL_R32UI);
        }
        glActiveTexture(GL_TEXTURE0 + upto(kUnits - 1));
        glViewport(GLint(upto(9)), GLint(upto(9)), GLsizei(upto(99)), GLsizei(upto(99)));
        glScissor(GLint(upto(9)), GLint(upto(9)), GLsizei(upto(99)), GLsizei(upto(99)));
        glClearColor(part(), part(), part(), part());
        glClearDepth(part());
        glBlendColor(part(), part(), part(), part());
        glBlendFunc(GL_SRC_ALPHA, coin() ? GL_ONE : GL_ONE_MINUS_SRC_ALPHA);
        glBlendEquation(coin() ? GL_FUNC_ADD : GL_MAX);
        glDepthFunc(GL_NEVER + upto(7));
        glDepthMask(GLboolean(coin()));
        glDepthRange(part(), part());
        glColorMask(GLboolean(coin()), GLboolean(coin()), GLboolean(coin()), GLboolean(coin()));
        glCullFace(coin() ? GL_FRONT : GL_BACK);
        glFrontFace(coin() ? GL_CW : GL_CCW);
        glLogicOp(GL_CLEAR + upto(15));
        glPointSize(1 + part());
        glPolygonOffset(part(), part());
        glStencilFunc(GL_NEVER + upto(7), GLint(upto(255)), upto(255));
        glStencilMask(upto(255));
        glSampleCoverage(part(), GLboolean(coin()));
        glProvokingVertex(coin() ? GL_FIRST_VERTEX_CONVENTION : GL_LAST_VERTEX_CONVENTION);
        glPrimitiveRestartIndex(upto(99));
        for (const GLenum what : {GL_PACK_ALIGNMENT, GL_UNPACK_ALIGNMENT})
            glPixelStorei(what, 1 << upto(3));
        for (const GLenum what :
             {GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS, GL_UNPACK_ROW_LENGTH, GL_UNPACK_SKIP_PIXELS})
            glPixelStorei(what, GLint(upto(9)));
        glPixelStorei(GL_UNPACK_SWAP_BYTES, GLint(upto(1)));
        EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)) << "the host's own";
        return count + 29;
    }
    // The state that tests need to read pixels.
    static void settle() {
        glUseProgram(0);
        glBindProgramPipeline(0);
        for (const GLenum target : {GL_PIXEL_PACK_BUFFER, GL_PIXEL_UNPACK_BUFFER})
            glBindBuffer(target, 0);
        for (const GLenum what : {GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS, GL_UNPACK_ROW_LENGTH,
                                  GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SWAP_BYTES})
            glPixelStorei(what, 0);
        for (const GLenum what : {GL_PACK_ALIGNMENT, GL_UNPACK_ALIGNMENT}) glPixelStorei(what, 4);
    }

  private:
    uint32_t upto(uint32_t most) { return random_() % (most + 1); }
    bool coin() { return upto(1) == 1; }
    float part() { return float(upto(64)) / 64; }
    GLuint buffer() { return buffers_[upto(2)]; }
    GLuint buffer_or_none() { return coin() ? buffer() : 0; }

    std::mt19937 random_;
    std::array<GLuint, 3> buffers_, textures_;
    std::array<GLuint, 2> samplers_;
    GLuint array_, cube_, vertices_, framebuffer_, renderbuffer_, program_, pipeline_;
};

std::string differences(const State& before, const State& after) {
    std::string text;
    for (const auto& [name, values] : before)
        if (after.at(name) != values) text += name + "; ";
    return text;
}

TEST(State, AHostileHostFindsAllOfItsOwn) {
    const auto host = canonical_frame(48, 40);
    const HostTexture output(GL_RGBA8, 48, 40);
    const auto guest = instance();
    const auto made = chain("motion_blur,fxaa,depth_of_field"), paper = paper_chain();
    // In place, and with import, export, and work lists of every kind.
    pc_frame plain = host.frame, turned = host.frame;
    turned.flags = PC_MOTION_TO_NEXT;
    turned.output = output;
    turned.pre_exposure = 2;
    pc_frame filled = plain;  // reads an array
    filled.debug_view = "fill";
    for (const pc_frame* frame : {&plain, &turned, &filled})
        for (const auto* one : {&made, &paper})
            ASSERT_EQ(pc_prepare(guest.get(), one->get(), frame, 1), PC_OK)
                << pc_last_error(guest.get());
    const ImageF expected = read(prepare_and_run(guest, made, plain), 48, 40);
    Hostile hostile(7);
    const int count = frames();
    int values = 0;
    for (int i = 0; i < count; ++i) {
        pc_frame frame = i % 2 ? turned : i % 8 == 6 ? filled : plain;
        if (i % 7 == 3) frame.flags |= PC_CAMERA_CUT;
        if (i % 11 == 5) frame.focus_distance *= 1 + float(i) / 64;
        values = hostile.set();
        const State before = read_state();
        glEnable(0xffff);  // GL_INVALID_ENUM stays the host's
        const auto& one = i % 5 < 2 ? paper : made;
        ASSERT_EQ(pc_run(guest.get(), one.get(), &frame, nullptr), PC_OK)
            << pc_last_error(guest.get());
        ASSERT_EQ(glGetError(), GLenum(GL_INVALID_ENUM)) << "frame " << i;
        ASSERT_EQ(glGetError(), GLenum(GL_NO_ERROR)) << "frame " << i;
        ASSERT_EQ(differences(before, read_state()), "") << "frame " << i;
    }
    EXPECT_GE(values, 90);
    Hostile::settle();
    const pc_texture result = prepare_and_run(guest, made, plain);
    EXPECT_TRUE(equal_bits(read(result, 48, 40), expected)) << "the state reached the picture";
}

TEST(State, PreparingChangesNone) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance();
    const auto made = chain("motion_blur,fxaa,depth_of_field");
    Hostile hostile(3);
    hostile.set();
    const State before = read_state();
    glEnable(0xffff);
    ASSERT_EQ(pc_prepare(guest.get(), made.get(), &host.frame, 1), PC_OK);
    EXPECT_EQ(glGetError(), GLenum(GL_INVALID_ENUM));
    EXPECT_EQ(differences(before, read_state()), "");
    float margin = 0;
    int signs[2];
    const pc_texture other = host.color;
    EXPECT_EQ(pc_check_motion(guest.get(), &host.frame, &other, signs, &margin), PC_OK);
    EXPECT_EQ(differences(before, read_state()), "") << "pc_check_motion";
}

// The host's groups fill the stack: labels push none, and so pop none of them.
TEST(State, LabelsLeaveTheGroupsOfTheHost) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance(PC_LABELS);
    const auto made = chain("motion_blur,fxaa");
    prepare_and_run(guest, made, host.frame);
    GLint before = 0, most = 0, after = 0;
    glGetIntegerv(GL_DEBUG_GROUP_STACK_DEPTH, &before);
    glGetIntegerv(GL_MAX_DEBUG_GROUP_STACK_DEPTH, &most);
    for (GLint depth = before; depth < most; ++depth)
        glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, "host");
    EXPECT_EQ(pc_run(guest.get(), made.get(), &host.frame, nullptr), PC_OK) << pc_error();
    glGetIntegerv(GL_DEBUG_GROUP_STACK_DEPTH, &after);
    EXPECT_EQ(after, most);
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    while (after-- > before) glPopDebugGroup();
}

// A program that the host deleted while it is in use ends with the use.
TEST(State, AProgramThatIsDeletedInUse) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance();
    const auto made = chain("fxaa");
    prepare_and_run(guest, made, host.frame);
    const char* source = "#version 450\nlayout(local_size_x = 1) in;\nvoid main() {}\n";
    const GLuint program = glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &source);
    glUseProgram(program);
    glDeleteProgram(program);
    EXPECT_EQ(pc_run(guest.get(), made.get(), &host.frame, nullptr), PC_OK) << pc_error();
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    EXPECT_EQ(read_state().at("program")[0], 0);
}

// With reset no object of the guest stays bound; with leave some do.
TEST(State, ResetAndLeave) {
    const auto host = canonical_frame(40, 24);
    const auto made = chain("motion_blur");
    {
        const auto guest = instance(0, PC_STATE_RESET);
        prepare_and_run(guest, made, host.frame);
        const State state = read_state();
        for (const auto& [name, values] : state) {
            const bool unit = name.starts_with("texture ") || name.starts_with("sampler ") ||
                              name.starts_with("image 0") || name.starts_with("storage buffer") ||
                              name == "program" || name.starts_with("uniform buffer") ||
                              name == "dispatch buffer";
            if (unit) {
                EXPECT_EQ(values[0], 0) << name;
            }
        }
    }
    const auto guest = instance(0, PC_STATE_LEAVE);
    prepare_and_run(guest, made, host.frame);
    EXPECT_NE(read_state().at("program")[0], 0);
}

}  // namespace
}  // namespace postchain::test::state_test
