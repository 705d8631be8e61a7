// The sample that executes plans itself (tools/samples/own_device) filters as the Vulkan library
// does, and the layers have nothing to say.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <vector>

#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tests/vulkan/frames.h"
#include "tools/samples/own_device/executor.h"

namespace postchain::test::own_device_test {
namespace {

enum : uint32_t { kColor = 1, kDepth, kMotion, kOutput };

// Quoted words for the shell.
void write_programs(const TempFolder& folder, const std::string& words) {
    const std::string command =
        concat(PROGRAMS_PROGRAM, " --format spirv --output ", folder.path("programs"), " ", words,
               " >", folder.path("log"), " 2>&1");
    ASSERT_EQ(std::system(command.c_str()), 0) << read_text(folder.path("log"));
}

struct DestroyPlanner {
    void operator()(pc_planner* planner) const { pc_plan_destroy(planner); }
};

// An engine: a planner for the largest frame, and the executor.
class Engine {
  public:
    explicit Engine(std::string programs) : programs_(std::move(programs)) {
        const ExecutorInfo info = {Vulkan::get().physical, Vulkan::get().device, 1,
                                   programs_.c_str()};
        executor_ = executor_create(&info);
    }
    ~Engine() { executor_destroy(executor_); }
    Engine(const Engine&) = delete;

    // Another largest frame.
    void resize(int width, int height) {
        auto info = pc::make<pc_plan_create_info>();
        info.api_version = PC_API_VERSION;
        info.max_width = uint32_t(width);
        info.max_height = uint32_t(height);
        pc_planner* made = nullptr;
        ASSERT_EQ(pc_plan_create(&info, &made), PC_OK) << pc_error();
        planner_.reset(made);
        executor_forget_storage(executor_);
    }

    ImageF filtered(const pc::Chain& chain, const VkFrame& given) {
        pc_frame frame = given.frame;
        const auto as_texture = [](const HostImage& image, uint32_t number, pc_format format) {
            return pc_texture{number, format, image.image().width, image.image().height, 0, 0};
        };
        frame.color = as_texture(given.color, kColor, PC_FORMAT_RGBA32F);
        frame.depth = as_texture(given.depth, kDepth, PC_FORMAT_R32F);
        frame.motion = as_texture(given.motion, kMotion, PC_FORMAT_RG32F);
        frame.output = as_texture(given.output, kOutput, PC_FORMAT_RGBA32F);
        uint64_t keys[512];
        uint32_t count = 512;
        EXPECT_EQ(pc_plan_programs(planner_.get(), chain.get(), &frame, keys, &count), PC_OK)
            << pc_error();
        executor_prepare(executor_, keys, count);
        auto plan = pc::make<pc_plan>();
        EXPECT_EQ(pc_plan_frame(planner_.get(), chain.get(), &frame, &plan), PC_OK) << pc_error();
        shapes += plan.shape != shape_;
        shape_ = plan.shape;
        const auto view = [](const HostImage& image) {
            return HostView{image.image().view, image.image().layout};
        };
        const HostView views[] = {view(given.color), view(given.depth), view(given.motion),
                                  view(given.output)};
        Vulkan::get().run([&](VkCommandBuffer commands) {
            full_barrier(commands);
            executor_record(executor_, commands, 0, &plan, views);
        });
        return given.output.read();
    }

    int shapes = 0;  // changes of the plan's shape

  private:
    const std::string programs_;
    Executor* executor_;
    std::unique_ptr<pc_planner, DestroyPlanner> planner_;
    uint64_t shape_ = 0;
};

// The frame's rectangle is a part of the images, as with dynamic resolution.
TEST(OwnDevice, HasTheBitsOfTheLibrary) {
    constexpr int kFrames = 60, kResizeAt = 40;
    constexpr const char* kPasses = "motion_blur,depth_of_field,fxaa";
    const TempFolder folder;
    write_programs(folder, kPasses);
    Engine engine(folder.path("programs"));
    const auto chain = test::chain(kPasses);
    VkInstanceOfChain vulkan;
    std::unique_ptr<VkFrame> frame;
    int differing = 0;
    for (int i = 0; i < kFrames; ++i) {
        SCOPED_TRACE(i);
        if (i == 0 || i == kResizeAt) {
            const int width = i == 0 ? 53 : 61, height = i == 0 ? 37 : 43;
            const auto host = canonical_frame(width, height, uint32_t(i) + 1);
            frame = std::make_unique<VkFrame>(host.test.planes, host.frame);
            frame->frame.flags &= ~uint32_t(PC_TOP_LEFT);  // converted before and after the chain
            vulkan = vk_instance(width, height);
            engine.resize(width, height);
        }
        pc_frame& values = frame->frame;
        values.width = frame->color.image().width - i % 7;
        values.height = frame->color.image().height - i % 5;
        values.frame_number = uint64_t(i);
        values.focus_distance = 1 + float(i % 9);
        values.flags &= ~uint32_t(PC_CAMERA_CUT);
        if (i % 10 == 9) values.flags |= PC_CAMERA_CUT;
        if (i >= 50) values.flags |= PC_HALF_PLANES;
        if (i % 6 == 5) set(chain, 2, "subpix", 0.01 * i);
        const ImageF blank(frame->color.image().width, frame->color.image().height, 4, 0.5f);
        frame->output.write(blank);
        const ImageF expected = filtered(vulkan, chain, *frame);
        frame->output.write(blank);
        const ImageF found = engine.filtered(chain, *frame);
        differing += !equal_bits(found, expected);
        EXPECT_FALSE(equal_bits(found, blank)) << "it did nothing";
    }
    EXPECT_EQ(differing, 0);
    EXPECT_GT(engine.shapes, 4);  // the cut's, and after the resize
}

// The program itself, under the layers: the wall is blurred behind a sharp disc.
TEST(OwnDevice, TheSampleWritesABlurredImage) {
    const TempFolder folder;
    write_programs(folder, "motion_blur,depth_of_field,fxaa");
    const std::string image = folder.path("image.ppm"), log = folder.path("log");
    // Leaks of the driver are not ours, and have no symbols once it is unloaded.
    const std::string command =
        "ASAN_OPTIONS=detect_leaks=0 VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation " +
        std::string(OWN_DEVICE_HOST) + " " + folder.path("programs") + " 3 " + image + " >" + log +
        " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read_text(log), "3 frames, the last of 640x360\n");
    std::ifstream in(image, std::ios::binary);
    std::string kind;
    int width = 0, height = 0, most = 0;
    in >> kind >> width >> height >> most;
    in.get();
    ASSERT_EQ(width, 640);
    ASSERT_EQ(height, 360);
    std::vector<unsigned char> pixels(size_t(width) * size_t(height) * 3);
    in.read(reinterpret_cast<char*>(pixels.data()), std::streamsize(pixels.size()));
    ASSERT_TRUE(in.good());
    const auto red = [&](int x, int y) { return int(pixels[3 * size_t(y * width + x)]); };
    // The disc's center is at 148, 180, its radius 90; the wall's checkers have red 13 and 38.
    EXPECT_NEAR(red(148, 180), 230, 1);
    int between = 0, edge = 0;
    for (int x = 400; x < 600; ++x) between += red(x, 170) > 16 && red(x, 170) < 35;
    EXPECT_GT(between, 10) << "the wall is sharp";
    for (int x = 200; x < 280; ++x) edge += red(x, 180) > 45 && red(x, 180) < 220;
    EXPECT_GT(edge, 4) << "the disc is sharp";
}

// A host of plans links no GL and no compiler.
TEST(OwnDevice, LinksThePlansAlone) {
    const TempFolder folder;
    const std::string list = folder.path("libraries");
    ASSERT_EQ(std::system(("ldd " + std::string(OWN_DEVICE_HOST) + " >" + list).c_str()), 0);
    const std::string text = read_text(list);
    EXPECT_NE(text.find("libvulkan.so"), text.npos) << text;
    for (const char* library : {"libepoxy", "libGL", "libEGL", "libOpenGL", "glslang", "SPIRV"})
        EXPECT_EQ(text.find(library), text.npos) << text;
}

}  // namespace
}  // namespace postchain::test::own_device_test
