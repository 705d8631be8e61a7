// A host for tests of the guest: a context of its own, textures, and frames made of them.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <postchain/postchain.hpp>

#include "chain/base/image.h"
#include "chain/pass/chain.h"
#include "tests/support/images.h"

namespace postchain::test {

// Makes a GL 4.5 core context current, once in a process: EGL without a window (host_egl.cpp), a
// GLFW window (host_glx.cpp), or WGL with a hidden window (host_wgl.cpp). If that fails, the
// process ends with a message.
void make_host_context();
// Releases the context from this thread, and makes it current again.
void release_host_context();
void regain_host_context();
// Another context of the same kind, or one with the compatibility profile, current until
// other_context_done().
void other_context();
void other_context_of_compatibility();
void other_context_done();

// A texture, deleted with this object.
class HostTexture {
  public:
    HostTexture(unsigned format, int width, int height);
    // With the image's pixels: the top row first, or last if bottom_up.
    HostTexture(unsigned format, const ImageF& pixels, bool bottom_up = false);
    ~HostTexture();
    HostTexture(HostTexture&& other) noexcept;
    HostTexture& operator=(HostTexture&&) = delete;
    const pc_texture& texture() const { return texture_; }
    operator pc_texture() const { return texture_; }
    // The image at x, y of a larger texture, whose other texels are 77.
    static HostTexture inside(unsigned format, const ImageF& pixels, int width, int height, int x,
                              int y);

  private:
    pc_texture texture_ = {};
};

// The rectangle of a texture, rows as stored.
ImageF read(const pc_texture& texture, int width, int height, int channels = 4);
ImageF upside_down(const ImageF& image);
// Motion vectors whose y points up.
ImageF with_y_up(ImageF motion);

// A canonical frame on the device: GL_RGBA32F, GL_R32F, GL_RG32F, read in place.
struct HostFrameTextures {
    TestFrame test;
    HostTexture color, depth, motion;
    pc_frame frame;
};
HostFrameTextures canonical_frame(int width, int height, uint32_t seed = 1);

// A neighbor of `host`, whose planes are made by add_neighbors(), on the device.
struct HostNeighbor {
    FramePlanes planes;  // under the names of its own frame
    HostTexture color, depth, motion;
    pc_frame frame;
};
HostNeighbor neighbor_of(const HostFrameTextures& host, Neighbor neighbor);
// The frame with the planes of this neighbor too.
TestFrame with_neighbor(TestFrame frame, const HostNeighbor& made, Neighbor neighbor);

// A failure fails the test.
pc::Instance instance(uint32_t flags = 0, pc_state state = PC_STATE_RESTORE);
pc::Chain chain(const char* passes);
// The methods of the papers, with all of their small steps and work lists: in place 0 the motion
// blur, in 1 the depth of field.
pc::Chain paper_chain(const char* passes = "motion_blur,depth_of_field,fxaa");
void set(const pc::Chain& chain, uint32_t pass, const char* key, double value);
// A depth of field in focus at this place.
pc::Chain focused(double x, double y);
// The chain run by the executor from planes in memory, as the command runs it. The largest speed is
// unknown, as to a guest.
ImageF by_executor(const TestFrame& frame, const Chain& chain,
                   Precision precision = Precision::fp32, Role plane = Role::color);
ImageF by_executor(const TestFrame& frame, const char* passes,
                   Precision precision = Precision::fp32, Role plane = Role::color);

void prepare(const pc::Instance& instance, const pc::Chain& chain, const pc_frame& frame);
pc_texture run(const pc::Instance& instance, const pc::Chain& chain, const pc_frame& frame);
pc_texture prepare_and_run(const pc::Instance& instance, const pc::Chain& chain,
                           const pc_frame& frame);
// A call that failed with this code, and the thread's message with this part.
void expect_error(pc_result found, pc_result code, const std::string& text);
// Not PC_OK; the code and the message are in the transcript.
void expect_refused(pc_result found);
pc_counters count(const pc::Instance& instance);
// Every member into the transcript.
void say(const pc_counters& counters);
void say(const pc_frame_needs& needs);
// No plan, texture or program was made in between.
void expect_nothing_made(const pc_counters& before, const pc_counters& after);

void expect_equal(const ImageF& found, const ImageF& expected);
// Pixels with a channel that differs by more than `tolerance` are at most this fraction.
void expect_near(const ImageF& found, const ImageF& expected, double tolerance,
                 double fraction = 0);

// What the tests of a suite share, so that programs are compiled once: a frame, an instance that
// validates, a chain, and the frame filtered by the executor.
class SharedScene : public ::testing::Test {
  protected:
    static constexpr int kWidth = 96, kHeight = 60;
    static constexpr const char* kPasses = "motion_blur,fxaa,depth_of_field";

    static void SetUpTestSuite();
    static void TearDownTestSuite() { shared_.reset(); }
    static const HostFrameTextures& host() { return shared_->host; }
    static const ImageF& plane(Role role) { return host().test.planes.at(role); }
    static const pc::Instance& guest() { return shared_->guest; }
    static const pc::Chain& made() { return shared_->made; }
    static const ImageF& expected() { return shared_->expected; }
    static ImageF filtered(const pc::Chain& chain, const pc_frame& frame) {
        return read(prepare_and_run(guest(), chain, frame), kWidth, kHeight);
    }

  private:
    struct Shared {
        HostFrameTextures host = canonical_frame(kWidth, kHeight);
        pc::Instance guest = instance(PC_VALIDATE);
        pc::Chain made = chain(kPasses);
        ImageF expected = by_executor(host.test, kPasses);
    };
    static std::unique_ptr<Shared> shared_;
};

}  // namespace postchain::test
