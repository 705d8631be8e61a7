// The library without glslang: programs of a set that postchain-programs wrote, and no others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>

#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tests/vulkan/frames.h"

namespace postchain::test {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 40, kHeight = 24;

std::string programs_of(const std::string& words) {
    const TempFolder folder;
    const std::string file = folder.path("programs");
    EXPECT_EQ(std::system((std::string(PROGRAMS_PROGRAM) + " " + words + " 2>" +
                           folder.path("log") + " >" + file)
                              .c_str()),
              0);
    return read_text(file);
}

pc_vk_create_info info_with(const std::string& programs) {
    pc_vk_create_info info = vk_info(kWidth, kHeight);
    info.load_program = nullptr;
    info.store_program = nullptr;
    info.programs = programs.data();
    info.programs_size = programs.size();
    return info;
}

TEST(NoCompiler, ProgramsOfTheSetAreEnough) {
    const std::string programs = programs_of("--mask --before motion_blur,fxaa tier:fast");
    const auto vulkan = vk_instance(info_with(programs));
    const auto canonical = canonical_frame(kWidth, kHeight);
    const HostNeighbor last = neighbor_of(canonical, Neighbor::before);
    const VkFrame before(last.planes, last.frame);
    for (const auto& [name, focuses] :
         {std::pair("motion_blur,fxaa", false), {"tier:fast", false}, {"tier:fast", true}}) {
        const auto made = chain(name);
        if (focuses) {
            EXPECT_EQ(pc_chain_set_point(made.get(), 0, "focus_at", 0.5, 0.5), PC_OK);
        }
        for (const uint32_t flags : {0u, uint32_t(PC_HALF_PLANES)}) {
            VkFrame frame(canonical.test.planes, canonical.frame);
            frame.frame.flags |= flags;
            HostImage mask(VK_FORMAT_R8G8B8A8_UNORM, kWidth, kHeight);
            mask.write(ImageF(kWidth, kHeight, 4, 0));
            EXPECT_FALSE(equal_bits(filtered(vulkan, made, frame), frame.color.read())) << name;
            frame.vk.before = &before.vk;
            EXPECT_FALSE(equal_bits(filtered(vulkan, made, frame), frame.color.read())) << name;
            frame.vk.before = nullptr;
            frame.vk.mask = mask;
            EXPECT_FALSE(equal_bits(filtered(vulkan, made, frame), frame.color.read())) << name;
        }
    }
    const pc_counters counters = count(vulkan);
    EXPECT_GT(counters.programs, 10u);
    EXPECT_EQ(counters.programs_loaded, counters.programs);
    // A chain that was not named.
    const auto other = chain("depth_of_field");
    VkFrame frame(canonical.test.planes, canonical.frame);
    expect_error(pc_vk_prepare(vulkan.get(), other.get(), &frame.vk, 1), PC_ERROR_GL,
                 "is not among pc_vk_create_info.programs, and this library has no compiler");
}

TEST(NoCompiler, DamagedSetsAreRefused) {
    const std::string good = programs_of("fxaa");
    const auto expect_refused = [](const std::string& bytes, const char* text) {
        const pc_vk_create_info info = info_with(bytes);
        pc_vk_instance* made = nullptr;
        EXPECT_EQ(pc_vk_create(&info, &made), PC_ERROR_ARGUMENT);
        EXPECT_THAT(pc_error(), HasSubstr(text));
    };
    constexpr size_t kCount = 32, kOffset = 48, kSize = 56;  // places, those of the first program
    const auto with = [&](size_t place, uint64_t number) {
        std::string bytes = good;
        std::memcpy(bytes.data() + place, &number, sizeof(number));
        return bytes;
    };
    for (const std::string& none :
         {std::string("no programs"), good.substr(0, 39), std::string(good.size(), 'x')})
        expect_refused(none, "programs: not a set of programs");
    expect_refused(good.substr(0, good.size() - 4), "programs: cut off");
    for (const uint64_t number : {uint64_t(good.size() - 40) / 24 + 1, ~uint64_t(0)})
        expect_refused(with(kCount, number), "programs: cut off");
    for (const uint64_t number : {uint64_t(good.size()) + 4, ~uint64_t(3)}) {
        expect_refused(with(kOffset, number), "programs: cut off");
        expect_refused(with(kSize, number), "programs: cut off");
    }
    expect_refused(with(kSize, 2), "programs: cut off");
    vk_instance(info_with(with(kCount, 0)));
    std::string other = good;
    other[8] = '9';
    expect_refused(other, "programs: of version 9.");
}

}  // namespace
}  // namespace postchain::test
