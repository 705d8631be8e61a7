// Requirements of every pass on the device: keep damage within its reach, leave nothing behind,
// leave the host's state alone, and accept any storage that its plan states.
#include <epoxy/gl.h>

#include <set>

#include "chain/gl/texture_pool.h"
#include "chain/gl/transfers.h"
#include "tests/conformance/conformance.h"

namespace postchain::device_test {
namespace {

using test::TestFrame;

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

class OnDevice : public Conformance {};

Box not_finite(const ImageF& image) {
    Box box;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < image.channels; ++c)
                if (!std::isfinite(image.at(x, y, c))) box.add(x, y);
    return box;
}

ImageF run(const Plan& plan, const FramePlanes& planes) {
    auto out = test::executor().filter(plan, planes);
    EXPECT_TRUE(out.ok()) << out.status().message();
    return out.ok() ? out->at(Role::color) : ImageF();
}

// Conversion replaces what is not finite, but an engine may hand in anything. The reach of a pass
// is what any finite change of one pixel changes; one that is not finite spoils no more. It may
// change the pixels around that too: steps compare pixels with those next to them.
TEST_P(OnDevice, NonFinitePixelsDoNoHarmBeyondThePassesReach) {
    const int width = 141, height = 101;  // more than what the passes reach from the middle
    const TestFrame frame = moving_frame(width, height);
    const Chain one = short_chain();
    const auto plan = make_plan(one, frame.description, everything());
    ASSERT_TRUE(plan.ok());
    const ImageF clean = run(*plan, frame.planes);
    const double guaranteed = one.reach(frame.description).depends_px;
    for (const PlanTexture& texture : plan->textures) {
        if (!texture.imported || texture.first_step < 0) continue;
        const Role role = texture.role;
        const ImageF& plane = frame.planes.at(role);
        const auto with = [&](int x, int y, float value) {
            FramePlanes planes = frame.planes;
            for (int c = 0; c < plane.channels; ++c) planes[role].at(x, y, c) = value;
            return run(*plan, planes);
        };
        // In the near layer, on its border, in the far one.
        for (const auto& [x, y] : {std::array{width / 2, height / 2},
                                   std::array{width / 4, height / 2}, std::array{2, 3}}) {
            const std::string where = concat(name_of(role), " at ", x, ",", y);
            Box reach;
            for (const float value : {0.0f, 97.0f, -97.0f, 60000.0f})
                reach.add(changed(with(x, y, value), clean));
            if (guaranteed < width) {
                EXPECT_LT(reach.area(), size_t(width) * size_t(height))
                    << where << ": the bound says nothing";
            }
            for (const float value : {kNaN, kInf, -kInf}) {
                const ImageF out = with(x, y, value);
                const Box spoiled = not_finite(out), box = changed(out, clean);
                EXPECT_TRUE(reach.contains(spoiled))
                    << where << ", " << value << ": " << spoiled.text() << " beyond "
                    << reach.text();
                EXPECT_TRUE(reach.grown(1).contains(box))
                    << where << ", " << value << ": " << box.text() << " beyond " << reach.text();
            }
        }
    }
}

// Textures come from a pool, with whatever they held.
TEST_P(OnDevice, NothingOfTheLastFrameIsLeft) {
    // Still but for a corner; blurred and sharp.
    TestFrame frame = test::layered_frame(101, 67, {0, 0}, {0, 0}, 5);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 20; ++x) frame.planes[Role::motion].at(x, y) = 23;
    frame.description = test::describe(frame.planes);
    frame.description.camera.f_stop = 0.2;
    const auto plan = make_plan(short_chain(), frame.description, everything());
    ASSERT_TRUE(plan.ok());
    const ImageF before = run(*plan, frame.planes);
    for (const float value : {kNaN, kInf, 1e30f}) {
        FramePlanes bad = frame.planes;
        for (auto& [role, plane] : bad) std::fill(plane.data.begin(), plane.data.end(), value);
        run(*plan, bad);
        EXPECT_TRUE(test::equal_bits(run(*plan, frame.planes), before)) << value;
        // Again with motion that no pass treats as zero.
        std::fill(bad[Role::motion].data.begin(), bad[Role::motion].data.end(), 50.0f);
        run(*plan, bad);
        EXPECT_TRUE(test::equal_bits(run(*plan, frame.planes), before)) << value << ", moving";
    }
}

// A plan is data: the format it states is the one that is allocated and bound.
TEST_P(OnDevice, EveryTextureIsStoredAsThePlanSays) {
    const TestFrame frame = moving_frame(37, 33);
    const auto full = make_plan(chain(), frame.description, everything());
    ASSERT_TRUE(full.ok());
    const auto is_half = [](float value) {
        // 2^-24 is the least half; above 2^-14 there are 11 significant bits.
        const float step =
            std::exp2(float(std::max(std::ilogb(std::max(std::abs(value), 1e-30f)), -14) - 10));
        // On a GPU a texel that no step writes may be anything, such as an infinite half.
        const bool gpu = test::executor().device_class() == DeviceClass::gpu;
        return (gpu && !std::isfinite(value)) ||
               (std::abs(value) <= 65504 && value / step == std::nearbyint(value / step));
    };
    // The share of a texture's values that are halves. Sampled: most images hold some.
    const auto halves = [&](const Plan& plan, const std::string& name) {
        double share = -1;
        const auto out = test::executor().filter(
            plan, frame.planes, [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
                if (texture.name != name) return Status();
                const auto count = std::count_if(pixels.data.begin(), pixels.data.end(), is_half);
                share = double(count) / double(pixels.data.size());
                return Status();
            });
        EXPECT_TRUE(out.ok()) << out.status().message();
        EXPECT_TRUE(all_finite(out->at(Role::color))) << name;
        return share;
    };
    double least = 1;
    for (size_t i = 0; i < full->textures.size(); ++i) {
        const PlanTexture& texture = full->textures[i];
        Plan half = *full;
        if (texture.imported || texture.first_step < 0) continue;
        if (texture.format == Format::rgba32f)
            half.textures[i].format = Format::rgba16f;
        else if (texture.format == Format::rg32f)
            half.textures[i].format = Format::rg16f;
        else if (texture.format == Format::r32f)
            half.textures[i].format = Format::r16f;
        else
            continue;
        EXPECT_EQ(halves(half, texture.name), 1) << texture.name;
        least = std::min(least, halves(*full, texture.name));
    }
    EXPECT_LT(least, 0.5) << "everything is a half anyway";
}

// Everything a host may have set, by name.
using GlState = std::map<std::string, std::vector<GLint>>;

// State that run() must not change, also without a guard that restores it.
GlState host_state() {
    GlState state;
    const auto get = [&](const char* name, GLenum what, int count = 1) {
        std::vector<GLint> values(size_t(count), 0);
        glGetIntegerv(what, values.data());
        state[name] = values;
    };
    const auto enabled = [&](const char* name, GLenum what) { state[name] = {glIsEnabled(what)}; };
    get("draw framebuffer", GL_DRAW_FRAMEBUFFER_BINDING);
    get("read framebuffer", GL_READ_FRAMEBUFFER_BINDING);
    get("renderbuffer", GL_RENDERBUFFER_BINDING);
    get("vertex array", GL_VERTEX_ARRAY_BINDING);
    get("array buffer", GL_ARRAY_BUFFER_BINDING);
    get("pixel unpack buffer", GL_PIXEL_UNPACK_BUFFER_BINDING);
    get("pixel pack buffer", GL_PIXEL_PACK_BUFFER_BINDING);
    get("copy read buffer", GL_COPY_READ_BUFFER_BINDING);
    get("copy write buffer", GL_COPY_WRITE_BUFFER_BINDING);
    get("active texture", GL_ACTIVE_TEXTURE);
    get("viewport", GL_VIEWPORT, 4);
    get("scissor box", GL_SCISSOR_BOX, 4);
    get("blend source", GL_BLEND_SRC_RGB);
    get("blend target", GL_BLEND_DST_ALPHA);
    get("blend equation", GL_BLEND_EQUATION_RGB);
    get("color mask", GL_COLOR_WRITEMASK, 4);
    get("depth mask", GL_DEPTH_WRITEMASK);
    get("depth function", GL_DEPTH_FUNC);
    get("cull face", GL_CULL_FACE_MODE);
    get("clip origin", GL_CLIP_ORIGIN);
    get("clip depth", GL_CLIP_DEPTH_MODE);
    enabled("blend", GL_BLEND);
    enabled("depth test", GL_DEPTH_TEST);
    enabled("stencil test", GL_STENCIL_TEST);
    enabled("scissor test", GL_SCISSOR_TEST);
    enabled("culling", GL_CULL_FACE);
    enabled("sRGB framebuffer", GL_FRAMEBUFFER_SRGB);
    const std::pair<const char*, GLenum> stores[] = {
        {"unpack alignment", GL_UNPACK_ALIGNMENT},   {"unpack row length", GL_UNPACK_ROW_LENGTH},
        {"unpack skip rows", GL_UNPACK_SKIP_ROWS},   {"unpack skip pixels", GL_UNPACK_SKIP_PIXELS},
        {"unpack swap bytes", GL_UNPACK_SWAP_BYTES}, {"pack alignment", GL_PACK_ALIGNMENT},
        {"pack row length", GL_PACK_ROW_LENGTH},     {"pack skip rows", GL_PACK_SKIP_ROWS},
        {"pack skip pixels", GL_PACK_SKIP_PIXELS},   {"pack swap bytes", GL_PACK_SWAP_BYTES}};
    for (const auto& [name, what] : stores) get(name, what);
    return state;
}

// State that run() may bind and leave bound (the guest library restores it): the program, texture
// and image units and samplers of the steps, the uniform buffer at 0, storage buffers of work lists
// with the buffer of indirect dispatch.
GlState bound_state() {
    GlState state;
    GLint value = 0;
    const auto get = [&](const std::string& name, GLenum what) {
        glGetIntegerv(what, &value);
        state[name] = {value};
    };
    const auto indexed = [&](const std::string& name, GLenum what, GLuint index) {
        glGetIntegeri_v(what, index, &value);
        state[concat(name, " ", index)] = {value};
    };
    get("program", GL_CURRENT_PROGRAM);
    get("uniform buffer", GL_UNIFORM_BUFFER_BINDING);
    get("storage buffer", GL_SHADER_STORAGE_BUFFER_BINDING);
    get("indirect buffer", GL_DISPATCH_INDIRECT_BUFFER_BINDING);
    for (GLuint i = 0; i < 8; ++i) {
        indexed("image", GL_IMAGE_BINDING_NAME, i);
        indexed("uniform buffer", GL_UNIFORM_BUFFER_BINDING, i);
        indexed("storage buffer", GL_SHADER_STORAGE_BUFFER_BINDING, i);
        indexed("texture", GL_TEXTURE_BINDING_2D, i);
        indexed("sampler", GL_SAMPLER_BINDING, i);
    }
    return state;
}

// Something other than what GL begins with, everywhere in host_state().
struct Host {
    GLuint framebuffer = 0, renderbuffer = 0, array = 0, buffer = 0;
    Host() {
        glGenFramebuffers(1, &framebuffer);
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        glGenRenderbuffers(1, &renderbuffer);
        glBindRenderbuffer(GL_RENDERBUFFER, renderbuffer);
        glGenVertexArrays(1, &array);
        glBindVertexArray(array);
        glGenBuffers(1, &buffer);
        for (const GLenum target : {GL_ARRAY_BUFFER, GL_PIXEL_UNPACK_BUFFER, GL_PIXEL_PACK_BUFFER,
                                    GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER})
            glBindBuffer(target, buffer);
        glActiveTexture(GL_TEXTURE5);
        glViewport(3, 5, 7, 11);
        glScissor(1, 2, 3, 4);
        glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
        glBlendEquation(GL_FUNC_REVERSE_SUBTRACT);
        glColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
        glDepthMask(GL_FALSE);
        glDepthFunc(GL_GEQUAL);
        glCullFace(GL_FRONT);
        glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
        for (const GLenum what : capabilities) glEnable(what);
        set_stores(1, 17, 2, 3, 1);
    }
    ~Host() {
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        glDeleteFramebuffers(1, &framebuffer);
        glDeleteRenderbuffers(1, &renderbuffer);
        glBindVertexArray(0);
        glDeleteVertexArrays(1, &array);
        glDeleteBuffers(1, &buffer);  // and unbinds it
        glActiveTexture(GL_TEXTURE0);
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        glDepthMask(GL_TRUE);
        glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
        for (const GLenum what : capabilities) glDisable(what);
        set_stores(4, 0, 0, 0, 0);
    }
    static constexpr GLenum capabilities[] = {GL_BLEND,        GL_DEPTH_TEST, GL_STENCIL_TEST,
                                              GL_SCISSOR_TEST, GL_CULL_FACE,  GL_FRAMEBUFFER_SRGB};
    static void set_stores(int alignment, int row, int rows, int pixels, int swap) {
        glPixelStorei(GL_UNPACK_ALIGNMENT, alignment);
        glPixelStorei(GL_PACK_ALIGNMENT, alignment);
        glPixelStorei(GL_UNPACK_ROW_LENGTH, row);
        glPixelStorei(GL_PACK_ROW_LENGTH, row);
        glPixelStorei(GL_UNPACK_SKIP_ROWS, rows);
        glPixelStorei(GL_PACK_SKIP_ROWS, rows);
        glPixelStorei(GL_UNPACK_SKIP_PIXELS, pixels);
        glPixelStorei(GL_PACK_SKIP_PIXELS, pixels);
        glPixelStorei(GL_UNPACK_SWAP_BYTES, swap);
        glPixelStorei(GL_PACK_SWAP_BYTES, swap);
    }
};

std::set<std::string> names_that_differ(const GlState& a, const GlState& b) {
    std::set<std::string> names;
    for (const auto& [name, values] : a)
        if (b.at(name) != values) names.insert(name);
    return names;
}

// The plan run on textures of the device, as an engine does it.
TEST_P(OnDevice, LeavesTheHostsStateAndBindsNothingThePlanDoesNotSay) {
    const TestFrame frame = moving_frame(37, 33);
    for (const bool elide : {false, true}) {
        PlanOptions options;
        options.elide = elide;
        const auto plan = make_plan(chain(), frame.description, options);
        ASSERT_TRUE(plan.ok());
        gl::TexturePool pool;
        std::map<Role, unsigned> inputs;
        for (const PlanTexture& texture : plan->textures) {
            if (!texture.imported || texture.first_step < 0) continue;
            const auto made = pool.acquire(texture);
            ASSERT_TRUE(made.ok());
            ASSERT_TRUE(gl::Transfers().upload(**made, frame.planes.at(texture.role)).ok());
            inputs[texture.role] = (*made)->name;
        }
        // Units and buffers that the plan says it uses.
        std::set<std::string> used = {"program", "uniform buffer", "uniform buffer 0"};
        for (const Step& step : plan->steps) {
            for (const Binding& binding : step.bindings) {
                if (binding.access == Access::write) {
                    used.insert(concat("image ", binding.unit));
                } else if (binding.access == Access::sample_nearest) {
                    used.insert(concat("texture ", binding.unit));
                    used.insert(concat("sampler ", binding.unit));
                } else {
                    used.insert(concat("storage buffer ", binding.unit));
                    used.insert("storage buffer");
                    used.insert("indirect buffer");
                }
            }
        }
        // Textures that earlier runs left bound may be deleted.
        for (GLuint i = 0; i < 8; ++i) {
            glBindTextureUnit(i, 0);
            glBindImageTexture(i, 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA32F);
            glBindBufferBase(GL_SHADER_STORAGE_BUFFER, i, 0);
        }
        glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, 0);
        const Host host;
        const GlState state = host_state(), bound = bound_state();
        for (int run = 0; run < 2; ++run) {
            const auto out = test::executor().run(*plan, inputs);
            ASSERT_TRUE(out.ok()) << out.status().message();
        }
        EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
        for (const std::string& name : names_that_differ(state, host_state()))
            ADD_FAILURE() << name << " was changed";
        for (const std::string& name : names_that_differ(bound, bound_state()))
            EXPECT_TRUE(used.count(name)) << name << " was changed; no step says so";
    }
}

FOR_EVERY_PASS(OnDevice);

}  // namespace
}  // namespace postchain::device_test
