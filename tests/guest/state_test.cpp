// The guest leaves the host's GL state as it was: in each frame the host sets some 80 values at
// random, the guest runs, and all values are compared.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <map>

#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"
#include "tests/support/random.h"

namespace postchain::test::state_test {
namespace {

constexpr int kFrames = 80;
constexpr int kUnits = 16, kImages = 8, kBuffers = 4;

struct Named {
    const char* name;
    GLenum value;
};
constexpr Named kSwitches[] = {{"blend", GL_BLEND},
                               {"cull", GL_CULL_FACE},
                               {"depth test", GL_DEPTH_TEST},
                               {"scissor", GL_SCISSOR_TEST},
                               {"stencil", GL_STENCIL_TEST},
                               {"sRGB", GL_FRAMEBUFFER_SRGB},
                               {"discard", GL_RASTERIZER_DISCARD},
                               {"restart", GL_PRIMITIVE_RESTART},
                               {"seamless", GL_TEXTURE_CUBE_MAP_SEAMLESS}};
constexpr Named kPixelStore[] = {
    {"pack alignment", GL_PACK_ALIGNMENT},         {"pack row length", GL_PACK_ROW_LENGTH},
    {"pack skip rows", GL_PACK_SKIP_ROWS},         {"pack skip pixels", GL_PACK_SKIP_PIXELS},
    {"pack swap bytes", GL_PACK_SWAP_BYTES},       {"unpack alignment", GL_UNPACK_ALIGNMENT},
    {"unpack row length", GL_UNPACK_ROW_LENGTH},   {"unpack skip rows", GL_UNPACK_SKIP_ROWS},
    {"unpack skip pixels", GL_UNPACK_SKIP_PIXELS}, {"unpack swap bytes", GL_UNPACK_SWAP_BYTES}};
struct BufferTarget {
    const char* name;
    GLenum target, binding;
};
constexpr BufferTarget kBufferTargets[] = {
    {"array buffer", GL_ARRAY_BUFFER, GL_ARRAY_BUFFER_BINDING},
    {"uniform buffer", GL_UNIFORM_BUFFER, GL_UNIFORM_BUFFER_BINDING},
    {"storage buffer", GL_SHADER_STORAGE_BUFFER, GL_SHADER_STORAGE_BUFFER_BINDING},
    {"atomic buffer", GL_ATOMIC_COUNTER_BUFFER, GL_ATOMIC_COUNTER_BUFFER_BINDING},
    {"dispatch buffer", GL_DISPATCH_INDIRECT_BUFFER, GL_DISPATCH_INDIRECT_BUFFER_BINDING},
    {"copy read buffer", GL_COPY_READ_BUFFER, GL_COPY_READ_BUFFER_BINDING},
    {"copy write buffer", GL_COPY_WRITE_BUFFER, GL_COPY_WRITE_BUFFER_BINDING},
    {"query buffer", GL_QUERY_BUFFER, GL_QUERY_BUFFER_BINDING},
    {"pack buffer", GL_PIXEL_PACK_BUFFER, GL_PIXEL_PACK_BUFFER_BINDING},
    {"unpack buffer", GL_PIXEL_UNPACK_BUFFER, GL_PIXEL_UNPACK_BUFFER_BINDING}};

using Values = std::map<std::string, std::vector<double>>;

// All state that a host may set, by name.
Values read_state() {
    Values state;
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
    number("draw framebuffer", GL_DRAW_FRAMEBUFFER_BINDING);
    number("read framebuffer", GL_READ_FRAMEBUFFER_BINDING);
    number("viewport", GL_VIEWPORT, 4);
    number("scissor box", GL_SCISSOR_BOX, 4);
    number("clear color", GL_COLOR_CLEAR_VALUE, 4);
    number("color mask", GL_COLOR_WRITEMASK, 4);
    for (const auto& [name, target, binding] : kBufferTargets) number(name, binding);
    for (const auto& [name, what] : kPixelStore) number(name, what);
    for (const auto& [name, what] : kSwitches) state[name] = {double(glIsEnabled(what))};
    for (GLuint i = 0; i < kBuffers; ++i) {
        indexed("uniform buffer", GL_UNIFORM_BUFFER_BINDING, i);
        indexed("uniform start", GL_UNIFORM_BUFFER_START, i);
        indexed("uniform size", GL_UNIFORM_BUFFER_SIZE, i);
        indexed("storage buffer", GL_SHADER_STORAGE_BUFFER_BINDING, i);
        indexed("storage start", GL_SHADER_STORAGE_BUFFER_START, i);
        indexed("storage size", GL_SHADER_STORAGE_BUFFER_SIZE, i);
    }
    for (GLuint i = 0; i < kImages; ++i) {
        indexed("image", GL_IMAGE_BINDING_NAME, i);
        indexed("level of image", GL_IMAGE_BINDING_LEVEL, i);
        indexed("layers of image", GL_IMAGE_BINDING_LAYERED, i);
        indexed("layer of image", GL_IMAGE_BINDING_LAYER, i);
        indexed("access of image", GL_IMAGE_BINDING_ACCESS, i);
        indexed("format of image", GL_IMAGE_BINDING_FORMAT, i);
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

GLuint compute_program() {
    const char* source = "#version 450 core\nlayout(local_size_x = 1) in; void main() {}\n";
    return glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &source);
}

// Objects to bind, and random values of all state.
class Hostile {
  public:
    explicit Hostile(uint32_t seed) : random_(seed), program_(compute_program()) {
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
        glGenProgramPipelines(1, &pipeline_);
        glBindProgramPipeline(pipeline_);
        EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)) << "the test's own";
    }
    void set() {
        for (const auto& [name, what] : kSwitches) coin() ? glEnable(what) : glDisable(what);
        for (const auto& [name, what] : kPixelStore) {
            const bool alignment = what == GL_PACK_ALIGNMENT || what == GL_UNPACK_ALIGNMENT;
            glPixelStorei(what, alignment ? 1 << upto(3) : upto(9));
        }
        glUseProgram(coin() ? program_ : 0);
        glBindProgramPipeline(coin() ? pipeline_ : 0);
        glBindVertexArray(coin() ? vertices_ : 0);
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, coin() ? framebuffer_ : 0);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, coin() ? framebuffer_ : 0);
        for (GLuint i = 0; i < kBuffers; ++i)
            for (const GLenum target : {GL_UNIFORM_BUFFER, GL_SHADER_STORAGE_BUFFER}) {
                if (coin())
                    glBindBufferRange(target, i, buffer(), 256 * upto(7), 256);
                else
                    glBindBufferBase(target, i, coin() ? buffer() : 0);
            }
        for (const auto& [name, target, binding] : kBufferTargets)
            glBindBuffer(target, coin() ? buffer() : 0);
        for (GLuint i = 0; i < kUnits; ++i) {
            glActiveTexture(GL_TEXTURE0 + i);
            glBindTexture(GL_TEXTURE_2D, coin() ? texture() : 0);
            glBindTexture(GL_TEXTURE_2D_ARRAY, coin() ? array_ : 0);
            glBindTexture(GL_TEXTURE_CUBE_MAP, coin() ? cube_ : 0);
            glBindSampler(i, coin() ? samplers_[size_t(upto(1))] : 0);
        }
        for (GLuint i = 0; i < kImages; ++i) {
            if (coin())
                glBindImageTexture(i, array_, 0, GLboolean(coin()), upto(2), GL_READ_WRITE,
                                   GL_RGBA8);
            else
                glBindImageTexture(i, coin() ? texture() : 0, upto(2), GL_FALSE, 0,
                                   coin() ? GL_READ_ONLY : GL_WRITE_ONLY, GL_R32UI);
        }
        glActiveTexture(GL_TEXTURE0 + GLenum(upto(kUnits - 1)));
        glViewport(upto(9), upto(9), upto(99), upto(99));
        glScissor(upto(9), upto(9), upto(99), upto(99));
        glClearColor(part(), part(), part(), part());
        glColorMask(GLboolean(coin()), GLboolean(coin()), GLboolean(coin()), GLboolean(coin()));
        EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)) << "the host's own";
    }

  private:
    int upto(int most) { return random_.whole(0, most); }
    bool coin() { return random_.chance(0.5); }
    float part() { return float(upto(64)) / 64; }
    GLuint buffer() { return buffers_[size_t(upto(2))]; }
    GLuint texture() { return textures_[size_t(upto(2))]; }

    Random random_;
    GLuint program_;
    std::array<GLuint, 3> buffers_, textures_;
    std::array<GLuint, 2> samplers_;
    GLuint array_, cube_, vertices_, framebuffer_, pipeline_;
};

std::string differences(const Values& before, const Values& after) {
    std::string text;
    for (const auto& [name, values] : before)
        if (after.at(name) != values) text += name + "; ";
    return text;
}

// In a context of its own, so that no other test sees what these bind and set.
class State : public ::testing::Test {
  protected:
    void SetUp() override {
        make_host_context();
        other_context();
    }
    void TearDown() override { other_context_done(); }
};

TEST_F(State, AHostileHostFindsAllOfItsOwn) {
    const auto host = canonical_frame(32, 24);
    const HostTexture output(GL_RGBA8, 32, 24);
    const auto guest = instance();
    const auto made = chain("motion_blur,fxaa,depth_of_field"), paper = paper_chain();
    // In place, with import and export, and one that reads an array.
    pc_frame plain = host.frame, turned = host.frame, filled = host.frame;
    turned.flags = PC_MOTION_TO_NEXT;
    turned.output = output;
    turned.pre_exposure = 2;
    filled.debug_view = "fill";
    const struct {
        const pc::Chain& chain;
        const pc_frame& frame;
    } kinds[] = {{made, plain}, {paper, turned}, {made, filled}};
    for (const auto& [one, frame] : kinds) prepare_and_run(guest, one, frame);
    const ImageF expected = read(prepare_and_run(guest, made, plain), 32, 24);
    Hostile hostile(7);
    gl_faults().silent_dispatches = true;
    for (int i = 0; i < kFrames; ++i) {
        pc_frame frame = kinds[i % 3].frame;
        if (i % 7 == 3) frame.flags |= PC_CAMERA_CUT;
        if (i % 11 == 5) frame.focus_distance *= 1 + float(i) / 64;
        hostile.set();
        const Values before = read_state();
        glEnable(0xffff);  // GL_INVALID_ENUM stays the host's
        ASSERT_EQ(pc_run(guest.get(), kinds[i % 3].chain.get(), &frame, nullptr), PC_OK)
            << pc_last_error(guest.get());
        ASSERT_EQ(glGetError(), GLenum(GL_INVALID_ENUM)) << "frame " << i;
        ASSERT_EQ(glGetError(), GLenum(GL_NO_ERROR)) << "frame " << i;
        ASSERT_EQ(differences(before, read_state()), "") << "frame " << i;
    }
    gl_faults().silent_dispatches = false;
    const pc_texture result = run(guest, made, plain);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    for (const auto& [name, what] : kPixelStore)
        glPixelStorei(what, what == GL_PACK_ALIGNMENT || what == GL_UNPACK_ALIGNMENT ? 4 : 0);
    EXPECT_TRUE(equal_bits(read(result, 32, 24), expected)) << "the state reached the image";
}

TEST_F(State, PreparingChangesNone) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance();
    const auto made = chain("motion_blur,fxaa,depth_of_field");
    Hostile hostile(3);
    hostile.set();
    const Values before = read_state();
    glEnable(0xffff);
    prepare(guest, made, host.frame);
    EXPECT_EQ(glGetError(), GLenum(GL_INVALID_ENUM));
    EXPECT_EQ(differences(before, read_state()), "");
    float margin = 0;
    int signs[2];
    const pc_texture other = host.color;
    EXPECT_EQ(pc_check_motion(guest.get(), &host.frame, &other, signs, &margin), PC_OK);
    EXPECT_EQ(differences(before, read_state()), "") << "pc_check_motion";
}

// The host's groups fill the stack: labels push none, and so pop none of them.
TEST_F(State, LabelsLeaveTheGroupsOfTheHost) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance(PC_LABELS);
    const auto made = chain("fxaa");
    prepare_and_run(guest, made, host.frame);
    GLint before = 0, most = 0, after = 0;
    glGetIntegerv(GL_DEBUG_GROUP_STACK_DEPTH, &before);
    glGetIntegerv(GL_MAX_DEBUG_GROUP_STACK_DEPTH, &most);
    for (GLint depth = before; depth < most; ++depth)
        glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, "host");
    run(guest, made, host.frame);
    glGetIntegerv(GL_DEBUG_GROUP_STACK_DEPTH, &after);
    EXPECT_EQ(after, most);
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    while (after-- > before) glPopDebugGroup();
}

// A program that the host deleted while it is in use ends with the use.
TEST_F(State, AProgramThatIsDeletedInUse) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance();
    const auto made = chain("fxaa");
    prepare_and_run(guest, made, host.frame);
    const GLuint program = compute_program();
    glUseProgram(program);
    glDeleteProgram(program);
    run(guest, made, host.frame);
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    EXPECT_EQ(read_state().at("program")[0], 0);
}

// With reset nothing stays bound to a unit that the chain uses, with leave some objects do.
TEST_F(State, ResetAndLeave) {
    const auto host = canonical_frame(40, 24);
    const auto made = chain("motion_blur");
    const auto bound = [](const char* kind) {
        int count = 0;
        const std::string name = kind;
        for (const auto& [key, values] : read_state())
            count += (key == name || key.starts_with(name + " ")) && values[0] != 0;
        return count;
    };
    const char* const kinds[] = {"program", "dispatch buffer", "uniform buffer", "storage buffer",
                                 "texture", "sampler",         "image"};
    {
        const auto guest = instance(0, PC_STATE_LEAVE);
        prepare_and_run(guest, made, host.frame);
        for (const char* kind : kinds) EXPECT_GT(bound(kind), 0) << kind;
        for (const char* kind : {"texture", "image"}) EXPECT_GT(bound(kind), 1) << kind;
    }
    const auto guest = instance(0, PC_STATE_RESET);
    prepare_and_run(guest, made, host.frame);
    for (const char* kind : kinds) EXPECT_EQ(bound(kind), 0) << kind;
}

}  // namespace
}  // namespace postchain::test::state_test
