// Dynamic resolution: frames of changing sizes share textures made for the largest, and have the
// bits of a render in textures of their own size.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <utility>

#include "chain/gl/device.h"
#include "chain/guest/max_frame_sizes.h"
#include "tests/guest/allocations.h"
#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"
#include "tests/support/random.h"

namespace postchain::test::sizes_test {
namespace {

constexpr int kFrames = 100;  // of each chain, converted or not
constexpr int kMaxWidth = 720, kMaxHeight = 36;

pc::Instance instance_for(uint32_t max_width, uint32_t max_height, uint32_t keep_frames = 0) {
    make_host_context();
    auto info = pc::create_info();
    info.state = PC_STATE_RESET;
    info.max_width = max_width;
    info.max_height = max_height;
    info.keep_frames = keep_frames;
    pc::Instance made = pc::create(info);
    EXPECT_TRUE(made) << pc_create_error();
    return made;
}

// A frame in the corner of textures that are as large as any frame can be, as an engine renders it.
struct Corner {
    HostTexture color, depth, motion, output;
    pc_frame frame;
};
Corner in_corner(const HostFrameTextures& tight) {
    const auto inside = [](unsigned format, const ImageF& plane) {
        return HostTexture::inside(format, plane, kMaxWidth, kMaxHeight, 0, 0);
    };
    const FramePlanes& planes = tight.test.planes;
    Corner corner = {inside(GL_RGBA32F, planes.at(Role::color)),
                     inside(GL_R32F, planes.at(Role::inverse_depth)),
                     inside(GL_RG32F, planes.at(Role::motion)),
                     HostTexture(GL_RGBA32F, ImageF(kMaxWidth, kMaxHeight, 4, 77)), tight.frame};
    corner.frame.width = tight.frame.color.width;
    corner.frame.height = tight.frame.color.height;
    corner.frame.color = corner.color;
    corner.frame.depth = corner.depth;
    corner.frame.motion = corner.motion;
    corner.frame.output = corner.output;
    return corner;
}

// `frame` is in the corner, and nothing was written beside it.
void expect_only_the_frame(const HostTexture& output, const ImageF& frame) {
    const auto all = HostTexture::inside(GL_RGBA32F, frame, kMaxWidth, kMaxHeight, 0, 0);
    expect_equal(read(output, kMaxWidth, kMaxHeight), read(all, kMaxWidth, kMaxHeight));
}

struct NamedChain {
    const char* name;
    std::function<pc::Chain()> make;
};
const NamedChain kChains[] = {
    {"inverse warp", [] { return chain("fxaa,depth_of_field,motion_blur"); }},
    {"papers", [] { return paper_chain("motion_blur,depth_of_field"); }},
    {"joint", [] {
         pc::Chain made = chain("joint_blur,fxaa");
         EXPECT_EQ(pc_chain_set_text(made.get(), 1, "mode", "directional"), PC_OK);
         return made;
     }}};

// A checked frame, as far as sizes need it.
struct SizedFrame {
    pc_frame given = {};
    guest::HostFrame frame;

    SizedFrame(int width, int height, bool output = true, uint32_t flags = 0) {
        given.flags = flags;
        frame.given = &given;
        frame.width = width;
        frame.height = height;
        frame.output.name = output ? 1 : 0;
    }
    operator const guest::HostFrame&() const { return frame; }
};

TEST(MaxFrameSizes, OfTheLargestFrameSeen) {
    guest::MaxFrameSizes sizes({0, 0}, 2);
    const auto size_for = [&](const guest::HostFrame& frame, bool runs = true) {
        const MaxFrameSize expected = sizes.expected(frame), size = sizes.size_for(1, frame, runs);
        return std::array{expected.width, expected.height, size.width, size.height};
    };
    EXPECT_EQ(size_for(SizedFrame(40, 24)), (std::array{40, 24, 40, 24}));
    EXPECT_EQ(size_for(SizedFrame(80, 20)), (std::array{80, 24, 80, 24}));
    for (const int side : {9, 99})
        EXPECT_EQ(size_for(SizedFrame(side, side, false)), (std::array{side, side, side, side}));
    EXPECT_EQ(size_for(SizedFrame(9, 8, true, PC_HALF_RESOLUTION)), (std::array{5, 4, 5, 4}));
    // They shrink after more than two frames of half the sides at most that run.
    for (const auto& [width, height] : {std::pair(41, 12), {40, 13}})
        for (int i = 0; i < 3; ++i) {
            EXPECT_EQ(size_for(SizedFrame(39, 10)), (std::array{80, 24, 80, 24}));
            EXPECT_EQ(size_for(SizedFrame(20, 12)), (std::array{80, 24, 80, 24}));
            EXPECT_EQ(size_for(SizedFrame(40, 12), false), (std::array{80, 24, 80, 24}));
            EXPECT_EQ(size_for(SizedFrame(width, height)), (std::array{80, 24, 80, 24}));
        }
    for (int i = 0; i < 2; ++i)
        EXPECT_EQ(size_for(SizedFrame(30, 9 + i)), (std::array{80, 24, 80, 24}));
    EXPECT_EQ(size_for(SizedFrame(20, 12)), (std::array{80, 24, 30, 12}));
    sizes.fall_back(1, {20, 12}, true);
    EXPECT_EQ(size_for(SizedFrame(10, 10)), (std::array{20, 12, 20, 12}));
    sizes.fall_back(1, {20, 12}, false);
    EXPECT_EQ(size_for(SizedFrame(10, 10)), (std::array{10, 10, 10, 10}));
}

TEST(MaxFrameSizes, OfTheStatedFrame) {
    guest::MaxFrameSizes sizes({101, 61}, 2);
    const auto size_for = [&](uint64_t chain, const guest::HostFrame& frame) {
        const MaxFrameSize size = sizes.size_for(chain, frame, true);
        return std::pair(size.width, size.height);
    };
    EXPECT_EQ(size_for(1, SizedFrame(10, 10, false)), std::pair(101, 61));
    EXPECT_EQ(sizes.expected(SizedFrame(10, 10, false)), (MaxFrameSize{101, 61}));
    EXPECT_EQ(size_for(1, SizedFrame(10, 70, true, PC_HALF_RESOLUTION)), std::pair(51, 35));
    EXPECT_EQ(sizes.expected(SizedFrame(110, 9, true, PC_HALF_RESOLUTION)), (MaxFrameSize{55, 31}));
    // A larger frame counts for as long as textures are kept.
    EXPECT_EQ(size_for(1, SizedFrame(120, 10)), std::pair(120, 61));
    for (int i = 0; i < 2; ++i) EXPECT_EQ(size_for(1, SizedFrame(101, 61)), std::pair(120, 61));
    EXPECT_EQ(size_for(1, SizedFrame(101, 61)), std::pair(101, 61));
    // Chains that do not fit get textures of their own size until they are prepared again; of the
    // first of nine this is forgotten.
    sizes.fall_back(1, {10, 10}, false);
    EXPECT_EQ(size_for(1, SizedFrame(10, 10)), std::pair(101, 61));
    for (uint64_t chain = 1; chain <= 9; ++chain) sizes.fall_back(chain, {10, 10}, true);
    EXPECT_EQ(size_for(1, SizedFrame(10, 10)), std::pair(101, 61));
    EXPECT_EQ(size_for(2, SizedFrame(10, 10)), std::pair(10, 10));
    EXPECT_EQ(size_for(9, SizedFrame(12, 8)), std::pair(12, 10));
    EXPECT_EQ(size_for(9, SizedFrame(30, 8, true, PC_HALF_RESOLUTION)), std::pair(15, 10));
    sizes.restore(9);
    EXPECT_EQ(size_for(9, SizedFrame(12, 8)), std::pair(101, 61));
    EXPECT_EQ(size_for(8, SizedFrame(12, 8)), std::pair(15, 10));
    for (int i = 0; i < 9; ++i) sizes.fall_back(8, {10, 10}, true);
    EXPECT_EQ(size_for(3, SizedFrame(10, 10)), std::pair(10, 10)) << "is not forgotten for it";
    EXPECT_EQ(size_for(1, SizedFrame(120, 10)), std::pair(120, 61));
    sizes.fall_back(2, {10, 10}, true);
    EXPECT_EQ(size_for(1, SizedFrame(10, 10)), std::pair(101, 61)) << "no larger frame any more";
}

// Sizes on both sides of one, two and many blocks. The papers' tiles grow with a wide frame.
TEST(Sizes, APartOfLargerTexturesHasTheBitsOfATightRender) {
    for (const NamedChain& named : kChains) {
        const auto made = named.make();
        const bool grows = named.name == std::string("papers");
        const std::array<int, 2> sizes[] = {
            {grows ? kMaxWidth : 90, kMaxHeight}, {1, 1}, {17, 33}, {grows ? 700 : 70, 30}};
        const auto stated = instance_for(kMaxWidth, kMaxHeight), seen = instance_for(0, 0);
        const auto plain = instance();
        for (const auto& [width, height] : sizes) {
            SCOPED_TRACE(concat(named.name, ", ", width, "x", height));
            const auto tight = canonical_frame(width, height, uint32_t(width));
            const ImageF expected = read(prepare_and_run(plain, made, tight.frame), width, height);
            const Corner corner = in_corner(tight);
            prepare_and_run(seen, made, corner.frame);
            expect_only_the_frame(corner.output, expected);
            // Without a texture of the host's: one of the library, of the stated size.
            pc_frame own = corner.frame;
            own.output = {};
            const pc_texture result = prepare_and_run(stated, made, own);
            expect_equal(read(result, width, height), expected);
            if (result.name != corner.frame.color.name) {
                EXPECT_EQ(result.width, kMaxWidth);
                EXPECT_EQ(result.height, kMaxHeight);
            }
        }
    }
}

// Debug views show the used part of a texture.
TEST(Sizes, DebugViewsShowTheFrame) {
    const auto made = paper_chain("motion_blur,depth_of_field");
    const auto stated = instance_for(kMaxWidth, kMaxHeight);
    for (const int width : {kMaxWidth, 90}) {
        const auto tight = canonical_frame(width, 30);
        Corner corner = in_corner(tight);
        for (const char* view : {"0.motion_blur.tile_max", "1.depth_of_field.blur_y",
                                 "0.motion_blur.full_blocks", "fill"}) {
            const auto fresh = instance();
            pc_frame frame = tight.frame;
            frame.debug_view = corner.frame.debug_view = view;
            const ImageF expected = read(prepare_and_run(fresh, made, frame), width, 30);
            SCOPED_TRACE(view);
            prepare_and_run(stated, made, corner.frame);
            expect_only_the_frame(corner.output, expected);
        }
    }
}

// Random sizes, together with another focus, shutter and number: no GL object, no allocation, no
// plan.
TEST(Sizes, RandomSizesMakeAndAllocateNothing) {
    Random random(7);
    for (const NamedChain& named : kChains) {
        SCOPED_TRACE(named.name);
        const auto made = named.make();
        // Sizes with another downsampling come and go.
        const auto guest = instance_for(kMaxWidth, kMaxHeight, kFrames);
        const auto tight = canonical_frame(kMaxWidth, kMaxHeight);
        Corner corner = in_corner(tight);
        // Half of the frames are converted from and to the host's conventions.
        for (const bool converted : {false, true}) {
            pc_frame frame = corner.frame;
            if (converted) {
                frame.flags = 0;
                frame.pre_exposure = 2;
            }
            prepare_and_run(guest, made, frame);
            const auto resize = [&](int i) {
                frame.width = random.whole(kMaxWidth / 2, kMaxWidth);
                frame.height = random.whole(kMaxHeight / 2, kMaxHeight);
                frame.focus_distance = tight.frame.focus_distance * (1 + 0.01f * float(i % 7));
                frame.frame_number = uint64_t(i);
            };
            gl_faults().silent_dispatches = true;
            // A lens's circle of confusion grows with the frame: a plan for each downsampling.
            for (int i = 0; i < 12; ++i) {
                resize(i);
                ASSERT_EQ(pc_run(guest.get(), made.get(), &frame, nullptr), PC_OK)
                    << pc_last_error(guest.get());
            }
            const pc_counters before = count(guest);
            silence_gl(true);
            uint64_t allocated = 0;
            GlCalls::start();
            for (int i = 0; i < kFrames; ++i) {
                resize(i);
                const uint64_t already = allocations();
                const pc_result result = pc_run(guest.get(), made.get(), &frame, nullptr);
                allocated += allocations() - already;
                if (result != PC_OK) break;
            }
            const auto calls = GlCalls::stop();
            silence_gl(false);
            gl_faults().silent_dispatches = false;
            const bool software = gl::describe_current().software;
            const pc_counters after = count(guest);
            EXPECT_EQ(after.frames, before.frames + kFrames) << pc_last_error(guest.get());
            EXPECT_EQ(allocated, 0u);
            expect_nothing_made(before, after);
            for (const auto& [name, number] : calls) {
                if (name == "glDeleteSync") {  // of the fence that every fourth frame makes
                    EXPECT_LE(number, kFrames / 4 + 1);
                    continue;
                }
                // The bands of a GPU are measured by queries.
                if (!software && name.starts_with("glGetQueryObject")) continue;
                EXPECT_FALSE(name.starts_with("glCreate") || name.starts_with("glDelete") ||
                             name.starts_with("glGet"))
                    << name;
            }
        }
    }
}

// 60 to 100 % of a size that was not stated: textures for the largest frame so far.
TEST(Sizes, TheLargestFrameSeenCounts) {
    const auto made = chain("motion_blur,fxaa");
    const auto guest = instance_for(0, 0);
    const Corner corner = in_corner(canonical_frame(kMaxWidth, kMaxHeight));
    pc_frame frame = corner.frame;
    prepare_and_run(guest, made, frame);
    const pc_counters before = count(guest);
    for (int i = 0; i < 40; ++i) {
        frame.width = kMaxWidth * (100 - i) / 100;
        frame.height = kMaxHeight * (100 - i) / 100;
        run(guest, made, frame);
    }
    EXPECT_EQ(count(guest).texture_allocations, before.texture_allocations);
    // Half its sides, for longer than keep_frames: the memory goes.
    frame.width = kMaxWidth / 2;
    frame.height = kMaxHeight / 2;
    for (int i = 0; i < 30; ++i) run(guest, made, frame);
    EXPECT_LT(count(guest).texture_bytes, before.texture_bytes / 2);
    // Not with a stated size.
    const auto stated = instance_for(kMaxWidth, kMaxHeight);
    prepare_and_run(stated, made, frame);
    for (int i = 0; i < 30; ++i) run(stated, made, frame);
    EXPECT_EQ(count(stated).texture_bytes, before.texture_bytes);
}

TEST(Sizes, StatedSizesThatCannotBe) {
    make_host_context();
    auto info = pc::create_info();
    pc_instance* made = nullptr;
    info.max_width = 1920;
    expect_error(pc_create(&info, &made), PC_ERROR_ARGUMENT, "max_width, max_height: 1920x0");
    info.max_height = 4000000000u;
    EXPECT_EQ(pc_create(&info, &made), PC_ERROR_ARGUMENT);
    EXPECT_EQ(made, nullptr);
}

// Textures that one larger frame needed go again.
TEST(Sizes, ALargerFrameThanStatedIsForgotten) {
    const auto made = chain("motion_blur,fxaa");
    const auto guest = instance_for(64, 48);
    const auto usual = canonical_frame(60, 40), large = canonical_frame(70, 50);
    prepare_and_run(guest, made, usual.frame);
    const uint64_t before = count(guest).texture_bytes;
    EXPECT_EQ(prepare_and_run(guest, made, large.frame).width, 70);
    pc_texture result = {};
    for (int i = 0; i < 30; ++i)
        ASSERT_EQ(pc_run(guest.get(), made.get(), &usual.frame, &result), PC_OK);
    EXPECT_EQ(count(guest).texture_bytes, before);
    EXPECT_EQ(result.width, 64);
}

// Only frames that ran shrink textures: a host that loads calls pc_prepare() again and again.
TEST(Sizes, PreparingShrinksNothing) {
    const auto made = chain("motion_blur,fxaa");
    const auto guest = instance_for(0, 0);
    const auto large = canonical_frame(kMaxWidth, kMaxHeight), small = canonical_frame(64, 20);
    const HostTexture output(GL_RGBA32F, kMaxWidth, kMaxHeight);
    pc_frame frame = large.frame, other = small.frame;
    frame.output = other.output = output;
    prepare_and_run(guest, made, frame);
    const uint64_t before = count(guest).texture_allocations;
    for (int i = 0; i < 40; ++i)
        ASSERT_EQ(pc_prepare(guest.get(), made.get(), &other, 0), PC_OK) << pc_error();
    run(guest, made, frame);
    EXPECT_EQ(count(guest).texture_allocations, before);
}

// Textures of the stated size that fit the budget only without another chain's replace those. A
// chain that does not fit at all gets its frame's size, and no other chain does.
TEST(Sizes, TheStatedSizeStaysWhenTheBudgetIsSpent) {
    make_host_context();
    const auto host = canonical_frame(64, 48);
    const HostTexture half(GL_RGBA16F, 64, 48);
    const auto blur = chain("motion_blur"), fxaa = chain("fxaa");
    pc_frame halves = host.frame;
    halves.color = half;
    halves.flags |= PC_HALF_PLANES;
    auto info = pc::create_info();
    info.max_width = info.max_height = 256;
    const auto bytes = [&](const pc::Chain& made, const pc_frame& frame) {
        auto needs = pc::make<pc_frame_needs>();
        const pc::Instance any = pc::create(info);
        EXPECT_EQ(pc_query_frame(any.get(), made.get(), &frame, &needs), PC_OK) << pc_error();
        return needs.texture_bytes;
    };
    info.texture_budget = std::max(bytes(blur, host.frame), bytes(fxaa, halves));
    const pc::Instance guest = pc::create(info);
    EXPECT_EQ(prepare_and_run(guest, blur, host.frame).width, 256);
    EXPECT_EQ(prepare_and_run(guest, fxaa, halves).width, 256);
    for (int i = 0; i < 12; ++i) prepare_and_run(guest, fxaa, halves);
    EXPECT_EQ(prepare_and_run(guest, blur, host.frame).width, 256);
    // In turn they do not make each other's textures again in every frame.
    uint64_t before = 0;
    for (int i = 0; i < 20; ++i) {
        if (i == 4) before = count(guest).texture_allocations;
        run(guest, fxaa, halves);
        run(guest, blur, host.frame);
    }
    EXPECT_EQ(count(guest).texture_allocations, before);
    info.texture_budget = bytes(fxaa, host.frame);
    const pc::Instance tight = pc::create(info);
    EXPECT_EQ(prepare_and_run(tight, blur, host.frame).width, 64);
    EXPECT_EQ(prepare_and_run(tight, fxaa, host.frame).width, 256);
    EXPECT_EQ(prepare_and_run(tight, blur, host.frame).width, 64);
}

}  // namespace
}  // namespace postchain::test::sizes_test
