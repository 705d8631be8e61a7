// Program binaries by the host's callbacks, and programs that pc_prepare() dispatches once.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"

namespace postchain::test::program_cache_test {
namespace {

constexpr int kWidth = 40, kHeight = 24;

using Bytes = std::vector<unsigned char>;
using Store = std::map<std::string, Bytes>;

pc::Instance instance_with(Store* store) {
    make_host_context();
    auto info = pc::create_info();
    info.user = store;
    info.load_program = [](void* user, const char* key, void* bytes, size_t room) -> size_t {
        const auto& all = *static_cast<Store*>(user);
        const auto found = all.find(key);
        if (found == all.end()) return 0;
        if (room >= found->second.size())
            std::memcpy(bytes, found->second.data(), found->second.size());
        return found->second.size();
    };
    info.store_program = [](void* user, const char* key, const void* bytes, size_t size) {
        const auto* first = static_cast<const unsigned char*>(bytes);
        (*static_cast<Store*>(user))[key] = Bytes(first, first + size);
    };
    pc::Instance made = pc::create(info);
    EXPECT_TRUE(made) << pc_error();
    return made;
}

TEST(ProgramCache, ASecondInstanceCompilesNothing) {
    const auto host = canonical_frame(kWidth, kHeight);
    const auto made = chain("motion_blur,fxaa");
    Store store;
    const auto first = instance_with(&store);
    const ImageF expected = read(prepare_and_run(first, made, host.frame), kWidth, kHeight);
    EXPECT_EQ(count(first).programs_loaded, 0u);
    EXPECT_EQ(store.size(), count(first).programs);
    EXPECT_GT(store.size(), 5u);

    const auto second = instance_with(&store);
    GlCalls::start();
    const ImageF found = read(prepare_and_run(second, made, host.frame), kWidth, kHeight);
    EXPECT_FALSE(GlCalls::stop().contains("glCompileShader"));
    EXPECT_TRUE(equal_bits(found, expected));
    EXPECT_EQ(count(second).programs, count(first).programs);
    EXPECT_EQ(count(second).programs_loaded, count(second).programs);
    // A cache that is full of other programs.
    const auto other = chain("depth_of_field");
    prepare_and_run(second, other, host.frame);
    EXPECT_GT(store.size(), count(first).programs);
}

// Damaged, shortened and foreign bytes are not used, and leave no GL error.
TEST(ProgramCache, DamagedBytesAreCompiledAgain) {
    const auto host = canonical_frame(kWidth, kHeight);
    const auto made = chain("motion_blur,fxaa");
    Store good;
    const ImageF expected =
        read(prepare_and_run(instance_with(&good), made, host.frame), kWidth, kHeight);
    void (*const damages[])(Bytes&) = {
        [](Bytes& bytes) { bytes.back() ^= 1; },
        [](Bytes& bytes) { bytes.resize(bytes.size() / 2); }, [](Bytes& bytes) { bytes.resize(3); },
        [](Bytes& bytes) { bytes[8] ^= 0xff; },  // the driver's format
        [](Bytes& bytes) { std::fill(bytes.begin(), bytes.end(), 0); }};
    for (const auto damage : damages) {
        Store store = good;
        for (auto& [key, bytes] : store) damage(bytes);
        const auto guest = instance_with(&store);
        GlCalls::start();
        const ImageF found = read(prepare_and_run(guest, made, host.frame), kWidth, kHeight);
        EXPECT_EQ(GlCalls::stop().count("glProgramBinary"), 0u) << "a driver may trust its bytes";
        EXPECT_TRUE(equal_bits(found, expected));
        EXPECT_EQ(count(guest).programs_loaded, 0u);
        EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
        EXPECT_EQ(store, good) << "stored again";
    }
}

// A driver may take a binary of an earlier version of it, and run it wrongly.
TEST(ProgramCache, BinariesOfAnotherDriverAreNotUsed) {
    const auto host = canonical_frame(kWidth, kHeight);
    const auto made = chain("fxaa");
    Store store;
    prepare(instance_with(&store), made, host.frame);
    const size_t programs = store.size();
    for (const unsigned name : {GL_VENDOR, GL_RENDERER, GL_VERSION}) {
        gl_faults().renamed = name;
        const auto other = instance_with(&store), again = instance_with(&store);
        gl_faults().renamed = 0;
        prepare(other, made, host.frame);
        EXPECT_EQ(count(other).programs_loaded, 0u);
        prepare(again, made, host.frame);
        EXPECT_EQ(count(again).programs_loaded, programs) << "stored for itself";
    }
    EXPECT_EQ(store.size(), 4 * programs);
}

// pc_prepare() dispatches each program once, and writes no texture of the host.
TEST(ProgramCache, PrepareDispatchesEachProgram) {
    const auto host = canonical_frame(kWidth, kHeight);
    const ImageF gray(kWidth, kHeight, 4, 5);
    const HostTexture output(GL_RGBA32F, gray);
    const auto made = paper_chain();
    pc_frame frame = host.frame;
    frame.output = output;
    const ImageF color = read(frame.color, kWidth, kHeight);
    const auto guest = instance();
    GlCalls::start();
    prepare(guest, made, frame);
    EXPECT_GT(GlCalls::stop().at("glDispatchCompute"), 10u);
    EXPECT_EQ(read(output, kWidth, kHeight), gray);
    EXPECT_TRUE(equal_bits(read(frame.color, kWidth, kHeight), color));
    // Nothing is left to do for the same frame.
    GlCalls::start();
    EXPECT_EQ(pc_prepare(guest.get(), made.get(), &frame, 0), PC_OK);
    EXPECT_EQ(GlCalls::stop().count("glDispatchCompute"), 0u);
}

}  // namespace
}  // namespace postchain::test::program_cache_test
