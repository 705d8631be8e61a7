// Prepared means prepared: after pc_prepare() no frame of its kind is refused, whatever its members
// hold. postchain.h (pc_prepare()) says what makes a kind.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <array>
#include <set>

#include "shaders/shared/inverse_warp_gather_units.h"
#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"
#include "tests/support/random.h"

namespace postchain::test::prepared_test {
namespace {

constexpr int kSide = 24;
constexpr int kFrames = 250;  // of each chain

// Textures of an engine, in several formats each.
class Textures {
  public:
    Textures() {
        make_host_context();
        for (const unsigned format : {GL_RGBA32F, GL_RGBA16F, GL_R11F_G11F_B10F, GL_SRGB8_ALPHA8})
            color_.emplace_back(format, kSide, kSide);
        for (const unsigned format : {GL_R32F, GL_R16F, GL_DEPTH_COMPONENT32F, GL_DEPTH24_STENCIL8})
            depth_.emplace_back(format, kSide, kSide);
        for (const unsigned format : {GL_RG32F, GL_RG16F, GL_RG16_SNORM, GL_RGBA16F})
            motion_.emplace_back(format, kSide, kSide);
        for (const unsigned format : {GL_RGBA32F, GL_RGBA16F, GL_RGBA8, GL_R11F_G11F_B10F})
            output_.emplace_back(format, kSide, kSide);
        exposure_.emplace_back(GL_R32F, ImageF(2, 2, 1, 0.7f));
        for (const unsigned format : {GL_R8, GL_R32F}) mask_.emplace_back(format, kSide, kSide);
    }

    // A neighbor of the frame, used or not.
    pc_frame neighbor(Random& random, const pc_frame& frame) const {
        pc_frame kind = frame;
        kind.mask = {};
        pc_frame made = this->frame(random, kind);
        if (random.chance(0.2)) return made;
        for (pc_texture* texture : {&made.color, &made.depth, &made.motion})
            texture->x = texture->y = 0;
        made.width = frame.width;
        made.height = frame.height;
        for (int i = 0; i < 2; ++i) made.depth_size[i] = made.motion_size[i] = 0;
        return made;
    }

    // A frame of a kind, every other member of it at random.
    pc_frame frame(Random& random, const pc_frame& kind) const {
        auto frame = pc::make<pc_frame>();
        frame.flags = kind.flags;
        for (const uint32_t bit :
             {PC_CAMERA_CUT, PC_TOP_LEFT, PC_MOTION_TO_NEXT, PC_MOTION_JITTERED})
            if (random.chance(0.5)) frame.flags |= bit;
        frame.frame_number = random.next();
        frame.width = random.whole(1, kSide);
        frame.height = random.whole(1, kSide);
        const auto one_of = [&](const std::vector<HostTexture>& textures) {
            pc_texture texture = textures[size_t(random.whole(0, int(textures.size()) - 1))];
            if (random.chance(0.5)) {
                texture.x = random.whole(0, kSide - frame.width);
                texture.y = random.whole(0, kSide - frame.height);
            }
            return texture;
        };
        frame.color = one_of(color_);
        frame.depth = one_of(depth_);
        frame.motion = one_of(motion_);
        if (random.chance(0.7)) frame.output = one_of(output_);
        if (random.chance(0.1) && frame.color.internal_format == GL_RGBA32F)
            frame.output = frame.color;
        if (kind.exposure.name) {
            frame.exposure = exposure_.front();
            frame.exposure.x = random.whole(0, 1);
            frame.exposure.y = random.whole(0, 1);
        }
        if (kind.mask.name && random.chance(0.5)) frame.mask = one_of(mask_);
        if (random.chance(0.3)) frame.depth_size[0] = frame.depth_size[1] = 1;
        if (random.chance(0.3)) {
            frame.motion_size[0] = random.whole(1, frame.width);
            frame.motion_size[1] = random.whole(1, frame.height);
        }
        frame.focus_radius = float(random.real(0, 0.2));
        if (random.chance(0.3)) frame.focus_seconds = float(random.real(0, 1));
        frame.frame_seconds = float(random.logarithmic(1e-3, 1));
        frame.debug_view = kind.debug_view;
        frame.depth_encoding = pc_depth(random.whole(0, PC_DEPTH_REVERSE_INFINITE));
        if (frame.depth_encoding > PC_DEPTH_INVERSE && random.chance(0.3)) {
            frame.depth_range[0] = float(random.real(0, 0.4));
            frame.depth_range[1] = float(random.real(0.5, 1));
        }
        frame.near_clip = float(random.logarithmic(0.01, 1));
        frame.far_clip = float(random.logarithmic(10, 1e4));
        for (int i = 0; i < 2; ++i) {
            if (random.chance(0.5)) frame.motion_scale[i] = float(random.real(-30, 30));
            if (random.chance(0.5)) frame.motion_bias[i] = float(random.real(-1, 1));
            frame.jitter_px[i] = float(random.real(-0.5, 0.5));
            frame.other_jitter_px[i] = float(random.real(-0.5, 0.5));
        }
        if (random.chance(0.5)) frame.pre_exposure = float(random.logarithmic(0.01, 100));
        frame.focal_length_mm = float(random.logarithmic(10, 300));
        frame.sensor_width_mm = float(random.logarithmic(5, 60));
        frame.f_stop = float(random.logarithmic(0.5, random.chance(0.1) ? 1e6 : 32));
        frame.focus_distance = float(random.logarithmic(0.5, 1000));
        if (random.chance(0.3)) frame.meters_per_unit = float(random.logarithmic(0.7, 10));
        if (random.chance(0.7)) frame.shutter_frames = float(random.real(-0.5, 1.5));
        if (random.chance(0.3)) frame.max_speed_px = float(random.logarithmic(0.01, 200));
        if (random.chance(0.3)) frame.nearest = float(random.logarithmic(0.1, 10));
        if (random.chance(0.3))
            frame.farthest = frame.nearest + float(random.logarithmic(0.1, 1e3));
        if (random.chance(0.1)) frame.farthest = frame.nearest;
        for (float* matrix : {frame.view_projection, frame.other_view_projection}) {
            if (random.chance(0.3)) continue;
            for (int i = 0; i < 16; ++i) matrix[i] = i % 5 == 0 ? 1 : float(random.real(-0.1, 0.1));
        }
        if (random.chance(0.2)) frame.barriers = GL_FRAMEBUFFER_BARRIER_BIT;
        if (random.chance(0.3)) frame.pixel_aspect = float(random.real(0.5, 2));
        return frame;
    }
    const HostTexture& exposure() const { return exposure_.front(); }
    const HostTexture& mask() const { return mask_.front(); }

  private:
    std::vector<HostTexture> color_, depth_, motion_, output_, exposure_, mask_;
};

TEST(Prepared, NoFrameOfTheKindIsRefused) {
    const Textures textures;
    const auto papers = paper_chain("motion_blur,depth_of_field,fxaa");
    const auto plain = chain("motion_blur,fxaa,depth_of_field"), joint = chain("joint_blur,fxaa");
    ASSERT_EQ(pc_chain_set_mask(plain.get(), 0, PC_MASK_UNMOVED), PC_OK);
    ASSERT_EQ(pc_chain_set_point(plain.get(), 2, "focus_at", 0.5, 0.5), PC_OK);
    // Radii up to a large part of the small image: downsampling by 1, 2 and 4, a program each.
    set(papers, 1, "max_radius_px", 40);
    for (const auto* made : {&papers, &plain, &joint}) {
        Random random(11);
        const auto guest = instance(0, PC_STATE_LEAVE);
        std::vector<pc_frame> kinds;
        for (const uint32_t flags : {0u, uint32_t(PC_NO_ELISION | PC_HALF_PLANES | PC_FAST_MATH)}) {
            auto kind = pc::make<pc_frame>();
            kind.flags = flags;
            if (flags != 0) kind.mask = textures.mask(), kind.exposure = textures.exposure();
            pc_frame first = textures.frame(random, kind);
            first.mask = kind.mask;
            first.flags &= ~uint32_t(PC_CAMERA_CUT);
            pc_frame earlier = first, later = first;
            if (flags == 0) first.before = &earlier;
            if (flags == 0 && made == &joint) first.after = &later;
            kind.before = first.before;
            kind.after = first.after;
            ASSERT_EQ(pc_prepare(guest.get(), made->get(), &first, 1), PC_OK)
                << pc_last_error(guest.get());
            kinds.push_back(kind);
        }
        const pc_counters before = count(guest);
        gl_faults().silent_dispatches = true;
        std::set<std::string> refused;
        int refusals = 0;
        for (int i = 0; i < kFrames; ++i) {
            const pc_frame& kind = kinds[size_t(random.whole(0, int(kinds.size()) - 1))];
            pc_frame frame = textures.frame(random, kind);
            const pc_frame earlier = textures.neighbor(random, frame),
                           later = textures.neighbor(random, frame);
            if (kind.before && random.chance(0.5)) frame.before = &earlier;
            if (kind.after && random.chance(0.5)) frame.after = &later;
            if (pc_run(guest.get(), made->get(), &frame, nullptr) == PC_OK) continue;
            ++refusals;
            refused.insert(pc_last_error(guest.get()));
        }
        gl_faults().silent_dispatches = false;
        for (const std::string& text : refused) ADD_FAILURE() << refusals << " refused: " << text;
        EXPECT_EQ(count(guest).programs, before.programs);
    }
}

// Each member that makes another kind is named, and its remedy helps.
TEST(Prepared, TheMessageNamesTheMember) {
    const Textures textures;
    const auto made = paper_chain();
    const auto host = canonical_frame(kSide, kSide);
    const struct {
        const char* text;
        void (*change)(pc_frame&, const Textures&);
    } cases[] = {{"flags: PC_HALF_PLANES, and not in pc_prepare(); call pc_prepare() with a frame",
                  [](pc_frame& frame, const Textures&) { frame.flags |= PC_HALF_PLANES; }},
                 {"flags: PC_FAST_MATH, and not in pc_prepare(); call pc_prepare() with a frame",
                  [](pc_frame& frame, const Textures&) { frame.flags |= PC_FAST_MATH; }},
                 {"exposure: given, and not to pc_prepare(); call",
                  [](pc_frame& frame, const Textures& of) { frame.exposure = of.exposure(); }},
                 {"mask: given, and not to pc_prepare(); call",
                  [](pc_frame& frame, const Textures& of) { frame.mask = of.mask(); }},
                 {"debug_view: pc_prepare() was not called with \"input.motion\"",
                  [](pc_frame& frame, const Textures&) { frame.debug_view = "input.motion"; }}};
    for (const auto& [text, change] : cases) {
        const auto guest = instance();
        expect_error(pc_run(guest.get(), made.get(), &host.frame, nullptr), PC_ERROR_PREPARE,
                     "pc_prepare() was not called for this chain");
        prepare_and_run(guest, made, host.frame);
        pc_frame frame = host.frame;
        change(frame, textures);
        expect_error(pc_run(guest.get(), made.get(), &frame, nullptr), PC_ERROR_PREPARE, text);
        prepare_and_run(guest, made, frame);
    }
    // Another chain, and another value that is a program.
    const auto guest = instance();
    const auto own = chain("motion_blur,fxaa"), other = chain("joint_blur");
    prepare_and_run(guest, own, host.frame);
    expect_error(pc_run(guest.get(), other.get(), &host.frame, nullptr), PC_ERROR_PREPARE,
                 "pc_prepare() was not called for this chain");
    ASSERT_EQ(pc_chain_set_text(own.get(), 1, "mode", "directional"), PC_OK);
    expect_error(pc_run(guest.get(), own.get(), &host.frame, nullptr), PC_ERROR_PREPARE,
                 "values were changed since pc_prepare()");
    prepare_and_run(guest, own, host.frame);
    pc_frame between = host.frame;
    for (const auto& [member, name] :
         {std::pair(&pc_frame::before, "before"), {&pc_frame::after, "after"}}) {
        between.*member = &host.frame;
        expect_error(pc_run(guest.get(), own.get(), &between, nullptr), PC_ERROR_PREPARE,
                     concat(name, ": given, and not to pc_prepare(); call"));
        pc_frame first = between;
        first.flags |= PC_CAMERA_CUT;
        prepare(guest, own, first);
        run(guest, own, between);
    }
    // Also if a frame with a flag was prepared later.
    pc_frame flagged = host.frame;
    flagged.flags |= PC_NO_ELISION;
    prepare_and_run(guest, own, flagged);
    ASSERT_EQ(pc_chain_set_text(own.get(), 0, "mode", "single"), PC_OK);
    expect_error(pc_run(guest.get(), own.get(), &host.frame, nullptr), PC_ERROR_PREPARE,
                 "values were changed since pc_prepare()");
    prepare_and_run(guest, own, host.frame);
    // Fewer planes are no other kind: motion vectors at a cut.
    pc_frame cut = host.frame;
    cut.flags |= PC_CAMERA_CUT;
    cut.motion = {};
    run(guest, own, cut);
}

// A frame at a cut and one that follows another are prepared together.
TEST(Prepared, TheFirstFrameOfAShotMakesNothing) {
    const auto host = canonical_frame(kSide, kSide);
    const auto made = chain("motion_blur,fxaa");
    pc_frame cut = host.frame;
    cut.flags |= PC_CAMERA_CUT;
    for (const bool cut_first : {false, true}) {
        const auto guest = instance();
        prepare(guest, made, cut_first ? cut : host.frame);
        const pc_counters before = count(guest);
        run(guest, made, cut_first ? host.frame : cut);
        expect_nothing_made(before, count(guest));
    }
}

// The textures of whole numbers that the current program reads.
std::vector<GLuint> whole_textures() {
    std::vector<GLuint> found;
    for (GLuint unit = 0; unit < 16; ++unit) {
        GLint name = 0, format = 0;
        glGetIntegeri_v(GL_TEXTURE_BINDING_2D, unit, &name);
        if (name != 0)
            glGetTextureLevelParameteriv(GLuint(name), 0, GL_TEXTURE_INTERNAL_FORMAT, &format);
        if (format == GL_RGBA32UI || format == GL_R32UI) found.push_back(GLuint(name));
    }
    return found;
}

int width_of(GLuint texture) {
    GLint width = 0;
    glGetTextureLevelParameteriv(texture, 0, GL_TEXTURE_WIDTH, &width);
    return width;
}

int height_of(GLuint texture) {
    GLint height = 0;
    glGetTextureLevelParameteriv(texture, 0, GL_TEXTURE_HEIGHT, &height);
    return height;
}

using Texels = std::vector<std::array<GLuint, 4>>;

Texels texels_of(GLuint texture) {
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    Texels texels(size_t(width_of(texture)) * size_t(height_of(texture)));
    glGetTextureImage(texture, 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT,
                      GLsizei(texels.size() * sizeof(texels[0])), texels.data());
    return texels;
}

bool is_unwritten(GLuint texture) {
    return texels_of(texture).back()[0] == ~0u;
}

std::string current_program() {
    GLint program = 0;
    glGetIntegerv(GL_CURRENT_PROGRAM, &program);
    char label[256] = {};
    glGetObjectLabel(GL_PROGRAM, GLuint(program), sizeof(label), nullptr, label);
    return label;
}

// A program is dispatched on textures that no step has written: it reads indices and counts there.
TEST(Prepared, AResizeDuringAPreparationLeavesNoTextureUnwritten) {
    make_host_context();
    const auto guest = instance(0, PC_STATE_LEAVE);
    const auto made = chain("joint_blur,fxaa");
    const auto small = canonical_frame(96, 60), large = canonical_frame(200, 150);
    int dispatches = 0;
    std::set<std::string> unwritten;
    gl_faults().fills_textures = true;
    gl_faults().before_dispatch = [&] {
        ++dispatches;
        for (const GLuint texture : whole_textures())
            if (is_unwritten(texture)) unwritten.insert(current_program());
    };
    // One program a call: interrupted before the first one that reads what bright_edges wrote.
    pc_result result = PC_PENDING;
    while (result == PC_PENDING && dispatches < 4)
        result = pc_prepare(guest.get(), made.get(), &small.frame, 0);
    EXPECT_EQ(result, PC_PENDING);
    while (result == PC_PENDING) result = pc_prepare(guest.get(), made.get(), &large.frame, 0);
    gl_faults().before_dispatch = nullptr;
    gl_faults().fills_textures = false;
    EXPECT_EQ(result, PC_OK);
    EXPECT_GT(dispatches, 4);
    for (const std::string& program : unwritten) ADD_FAILURE() << program;
    run(guest, made, large.frame);
}

// A count that only a damaged texture has is that of as many start surfaces as there is room for.
TEST(Prepared, ACountOfStartSurfacesIsBounded) {
    make_host_context();
    const auto guest = instance(0, PC_STATE_LEAVE);
    const auto made = chain("joint_blur");
    set(made, 0, "starts", 1);
    const auto host = canonical_frame(96, 60);
    const ImageF expected = read(prepare_and_run(guest, made, host.frame), 96, 60);
    int full = 0;
    gl_faults().before_dispatch = [&] {
        if (current_program().find("inverse_warp/gather.comp") == std::string::npos) return;
        GLint name = 0;
        glGetIntegeri_v(GL_TEXTURE_BINDING_2D, GATHER_STARTS, &name);
        const auto starts = GLuint(name);
        const int width = width_of(starts), room = width / 6 - 1;
        Texels texels = texels_of(starts);
        for (size_t i = size_t(room); i < texels.size(); i += size_t(room) + 1) {
            if (texels[i][1] != GLuint(room)) continue;
            ++full;
            texels[i][1] |= 0x80000000u;
        }
        glTextureSubImage2D(starts, 0, 0, 0, width, height_of(starts), GL_RGBA_INTEGER,
                            GL_UNSIGNED_INT, texels.data());
    };
    const ImageF found = read(run(guest, made, host.frame), 96, 60);
    gl_faults().before_dispatch = nullptr;
    EXPECT_GT(full, 0);
    expect_equal(found, expected);
}

}  // namespace
}  // namespace postchain::test::prepared_test
