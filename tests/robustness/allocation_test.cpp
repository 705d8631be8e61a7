// Allocation n = 1, 2, ... fails while strings are parsed and frames are read and written: a status
// reports it, nothing aborts, and no partial or temporary files are left. malloc is replaced for
// the whole process, including libraries.
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <functional>
#include <map>

#include "config/camera_file.h"
#include "config/chain_find.h"
#include "config/profile.h"
#include "passes/registry.h"
#include "tests/io/exr_files.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/planes/frame_reader.h"
#include "tools/sequence/planes/frame_writer.h"

namespace {

// Number of allocations by all threads since counting began; the one with this number fails, or all
// from it on.
std::atomic<bool> counted = false;
std::atomic<long> allocations = 0;
long failing = 0;
bool for_good = false;

bool is_there_room() {
    if (!counted.load()) return true;
    const long number = ++allocations;
    return for_good ? number < failing : number != failing;
}

void* none() {
    errno = ENOMEM;
    return nullptr;
}

}  // namespace

// glibc's own functions, under the names it provides for replacing malloc.
extern "C" {
void* __libc_malloc(size_t bytes);
void* __libc_calloc(size_t count, size_t bytes);
void* __libc_realloc(void* old, size_t bytes);
void* __libc_memalign(size_t alignment, size_t bytes);

void* malloc(size_t bytes) {
    return is_there_room() ? __libc_malloc(bytes) : none();
}
void* calloc(size_t count, size_t bytes) {
    return is_there_room() ? __libc_calloc(count, bytes) : none();
}
void* realloc(void* old, size_t bytes) {
    return is_there_room() ? __libc_realloc(old, bytes) : none();
}
void* aligned_alloc(size_t alignment, size_t bytes) {
    return is_there_room() ? __libc_memalign(alignment, bytes) : none();
}
int posix_memalign(void** out, size_t alignment, size_t bytes) {
    void* made = is_there_room() ? __libc_memalign(alignment, bytes) : nullptr;
    if (made == nullptr) return ENOMEM;
    *out = made;
    return 0;
}
}

namespace postchain {
namespace {

// Number of allocations of `work` without a failure, or until it ends after one.
template <class Work>
long count_during(long number, bool from_there_on, const Work& work) {
    failing = number;
    for_good = from_there_on;
    allocations = 0;
    counted = true;
    try {
        work();
    } catch (const std::exception& error) {
        counted = false;
        ADD_FAILURE() << "allocation " << number << ": " << error.what() << " left the library";
    }
    counted = false;
    return allocations;
}

class Allocations : public testing::Test {
  protected:
    using Work = std::function<Status()>;

    // Fails `work` at each number, permanently and once. What it says is ok has the `result` of the
    // first time.
    template <class Result>
    void fail_each(const char* name, const Work& work, const Result& result) {
        ASSERT_TRUE(work().ok());  // allocates everything that is made only once
        const auto expected = result();
        const auto whole = [&] { return result() == expected; };
        Status status;
        const long all = count_during(0, false, [&] { status = work(); });
        ASSERT_TRUE(status.ok()) << status.message();
        ASSERT_GT(all, 1) << name;
        long trials = 0, refused = 0;
        for (const bool from_there_on : {false, true}) {
            for (long number = 1; number <= all; ++number) {
                ++trials;
                clean_up();
                count_during(number, from_there_on, [&] { status = work(); });
                const auto place = testing::Message()
                                   << name << ", allocation " << number << " of " << all
                                   << (from_there_on ? " and all after it" : "");
                EXPECT_EQ(temporaries(), std::vector<std::string>()) << place;
                if (status.ok()) {
                    EXPECT_TRUE(whole()) << place << ": is ok, and not whole";
                    continue;
                }
                ++refused;
                EXPECT_EQ(status.code(), StatusCode::memory) << place << ": " << status.message();
                EXPECT_NE(status.message().find("memory"), std::string::npos)
                    << place << ": " << status.message();
            }
        }
        EXPECT_GT(refused, trials / 2) << name;
        std::printf("%s: %ld allocations, %ld failures, %ld refused\n", name, all, trials, refused);
        // Failures do not affect later work.
        clean_up();
        ASSERT_TRUE(work().ok()) << name;
        EXPECT_TRUE(whole()) << name;
    }

    void clean_up() const {
        for (const auto& name : folder_.names())
            if (name.starts_with("out")) std::filesystem::remove(folder_.path(name));
    }
    std::vector<std::string> temporaries() const {
        std::vector<std::string> found;
        for (const auto& name : folder_.names())
            if (name.starts_with(".")) found.push_back(name);
        return found;
    }
    std::string bytes(const std::string& name) const { return test::read_text(folder_.path(name)); }
    std::string write_text(const std::string& name, const std::string& text) const {
        test::write_text(folder_.path(name), text);
        return folder_.path(name);
    }
    // Two parts, one kept as stored. `tile`: tile size of that part, 0 for scanlines.
    void write_frame(int tile) const {
        const test::FilePart other{
            .name = "other", .channels = {{"id.X", Imf::UINT}}, .tile = tile};
        test::write_file(folder_.path("in.exr"), {test::rgba_z("color"), other});
    }

    Result<io::StoredFrame> read_frame(const io::FrameFiles& files) const {
        return io::read_frame(files, roles_, {Role::color}, io::Keep::all);
    }

    // Only the library calls may fail: arguments are made before.
    test::TempFolder folder_;
    const std::string out_ = folder_.path("out.exr");
    const std::map<Role, std::string> files_ = {{Role::color, folder_.path("in.exr")}};
    const io::FrameChannels roles_ = {{Role::color, {0, {"R", "G", "B", "A"}}}};
};

TEST_F(Allocations, ChainFile) {
    const std::string path = write_text("chain.yaml",
                                        "postchain: 1\n"
                                        "camera: {focal_length_mm: 50, f_stop: 1.8}\n"
                                        "passes:\n"
                                        "  - motion_blur: {samples: 25, shutter_frames: 0.5}\n"
                                        "  - fxaa: {preset: 12, hint: threshold}\n"
                                        "  - depth_of_field: {method: gilham}\n");
    const std::vector<std::string> sets = {"motion_blur.samples=9"};
    Chain chain;
    fail_each(
        "a chain file",
        [&] {
            chain = Chain();
            ASSIGN_OR_RETURN(auto file, load_chain(path, builtin_passes(), sets));
            RETURN_IF_ERROR(file.status());
            chain = std::move(file.chain);
            return Status();
        },
        [&] { return chain.hash(); });
    EXPECT_EQ(chain.types().size(), 3u);
}

TEST_F(Allocations, CameraFile) {
    const std::string path =
        write_text("camera.json",
                   "{\"focal_length_mm\": 35, \"f_stop\": 1.5, \"focus_distance\": 3, \"fps\": 24,"
                   " \"frames\": {\"7\": {\"f_stop\": 2.5}, \"8\": {\"f_stop\": 4}}}");
    Camera camera;
    fail_each(
        "a camera file",
        [&] {
            camera = Camera();
            ASSIGN_OR_RETURN(const auto file, load_camera(path));
            RETURN_IF_ERROR(file.status());
            camera = file.camera_for(7, {1920, 1080, 1});
            return Status();
        },
        [&] { return camera.f_stop; });
    EXPECT_EQ(camera.f_stop, 2.5);
}

TEST_F(Allocations, Profile) {
    const std::string path = write_text(
        "mine.yaml", test::read_text(POSTCHAIN_SOURCE_DIR "/config/profiles/cycles.yaml"));
    size_t roles = 0;
    fail_each(
        "a profile",
        [&] {
            roles = 0;
            ASSIGN_OR_RETURN(const auto profile, find_profile(path));
            roles = profile.roles.size();
            return Status();
        },
        [&] { return roles; });
    EXPECT_GE(roles, 3u);
}

TEST_F(Allocations, ReadingAFrame) {
    write_frame(8);
    for (const int threads : {0, 2}) {
        io::set_exr_threads(threads);
        ImageF color;
        fail_each(
            "reading a frame",
            [&] {
                color = ImageF();
                ASSIGN_OR_RETURN(const auto files, io::open_frame(files_, 1));
                ASSIGN_OR_RETURN(auto frame, read_frame(files));
                color = std::move(frame.planes.at(Role::color));
                return Status();
            },
            [&] { return color; });
        EXPECT_FALSE(color.empty());
    }
    io::set_exr_threads(0);
}

// Scanlines only: if memory runs out in the constructor of its tile writer, OpenEXR 3.1 frees
// memory it never had (docs/testing.md).
TEST_F(Allocations, WritingAFrame) {
    write_frame(0);
    io::WriteOptions options;
    options.on_existing = io::OnExisting::overwrite;
    io::FilteredLayer filtered = {0, roles_.at(Role::color).channels, nullptr};
    fail_each(
        "writing a frame",
        [&] {
            ASSIGN_OR_RETURN(const auto files, io::open_frame(files_, 1));
            ASSIGN_OR_RETURN(auto frame, read_frame(files));
            const ImageF color = std::move(frame.planes.at(Role::color));
            filtered.image = &color;
            return io::write_filtered(out_, files.color_file(), frame, filtered, options).status();
        },
        [&] { return bytes("out.exr"); });
    EXPECT_GT(bytes("out.exr").size(), 500u);
}

TEST_F(Allocations, WritingPlanes) {
    const ImageF image(9, 7, 3);
    const std::vector<std::string> names = {"R", "G", "B"};
    fail_each(
        "writing planes",
        [&] {
            return io::write_planes_exr(out_, image, names, io::OnExisting::overwrite).status();
        },
        [&] { return bytes("out.exr"); });
}

TEST_F(Allocations, WritingText) {
    const std::string text(3'000'000, 'x');  // larger than the buffer
    fail_each(
        "writing a text",
        [&] { return io::atomic_write_text(out_, text, io::OnExisting::overwrite).status(); },
        [&] { return bytes("out.exr"); });
    EXPECT_TRUE(bytes("out.exr") == text);
}

}  // namespace
}  // namespace postchain
