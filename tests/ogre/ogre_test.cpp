// The chain in OGRE (tools/samples/ogre): its result is close to the image that the engine
// accumulates over shutter and lens, and the engine is not affected. Every wrong convention must
// fail.
#include <OgreScriptCompiler.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/ogre/truth.h"

namespace postchain {
namespace {

constexpr double kFrame = 31;  // the camera pans at its fastest
constexpr int kSamples = 256;

// An aperture that is not its own mirror image, so that its shape shows rows and the lens's sign.
#define APERTURE "postchain: 1\ncamera: {aperture_blades: 3, aperture_rotation_deg: 20}\n"

struct Case {
    const char* name;
    const char* chain;
    bool shutter, lens;
    double limit_db;  // 1.5 dB below what was measured
};
constexpr Case kMotion = {"motion", "postchain: 1\npasses: [motion_blur]\n", true, false, 35.8};
constexpr Case kLens = {"lens", APERTURE "passes: [depth_of_field]\n", false, true, 39.3};
constexpr Case kBoth = {"both", APERTURE "passes: [joint_blur: {samples: 32}]\n", true, true, 37.0};
constexpr Case kBalanced = {
    "balanced",
    APERTURE "passes: [joint_blur: {samples: 28, starts: 6}, fxaa: {mode: directional}]\n", true,
    true, 37.4};
// Not measured: the passes of the 2013 report, which use more kinds of bindings.
constexpr char kReport[] =
    "postchain: 1\npasses: [motion_blur: {mode: guertin}, fxaa, depth_of_field: {method: "
    "gilham}]\n";

class InOgre : public testing::Test {
  protected:
    static void SetUpTestSuite() { open({.width = 480, .height = 270}); }
    static void TearDownTestSuite() {
        truths_.clear();
        host_.reset();
    }
    static void open(const host::HostSettings& settings) {
        host_.reset();  // only one OGRE can exist
        host_ = std::make_unique<host::Host>(settings);
        host_->set_text("frame 31\nengine");
    }
    void SetUp() override {
        guest().adjust = {};
        guest().output.reset();
        set_chain(nullptr);
    }

    static host::PostchainPass& guest() { return host_->postchain(); }
    static void set_chain(const char* text) { postchain::set_chain(guest(), text); }
    // A frame and the one before it, so that it has motion.
    static ImageF draw(const char* chain) {
        set_chain(nullptr);
        host_->draw(kFrame - 1);
        set_chain(chain);
        host_->draw(kFrame);
        EXPECT_EQ(guest().error(), "");
        return read_texture(host_->plane(0));
    }
    static const ImageF& truth(const Case& c) {
        const auto key = std::make_pair(c.shutter, c.lens);
        if (!truths_.contains(key)) {
            set_chain(nullptr);
            truths_[key] = draw_truth(*host_, {.samples = kSamples,
                                               .frame = kFrame,
                                               .shutter = c.shutter,
                                               .lens = c.lens,
                                               .blades = 3,
                                               .rotation_deg = 20});
        }
        return truths_[key];
    }
    static void expect_near_truth(const Case& c) {
        const ImageF drawn = draw(nullptr), filtered = draw(c.chain);
        const double before = psnr(drawn, truth(c)), after = psnr(filtered, truth(c));
        std::printf("%-10s unfiltered %.2f dB, filtered %.2f dB\n", c.name, before, after);
        EXPECT_GE(after, before + 5) << c.name;
        EXPECT_GE(after, c.limit_db) << c.name;
    }
    // With this fault the same case must exceed the limit.
    static void expect_seen(const Case& c, const char* fault,
                            const std::function<void(pc_frame&)>& adjust) {
        guest().adjust = adjust;
        const double found = psnr(draw(c.chain), truth(c));
        guest().adjust = {};
        std::printf("%-10s %s: %.2f dB\n", c.name, fault, found);
        EXPECT_LT(found, c.limit_db) << c.name << ": " << fault;
    }

    // A texture of OGRE with the size and format of the scene's color.
    class TextureLikeColor {
      public:
        explicit TextureLikeColor(const char* name) {
            const auto color = host_->plane(0);
            texture_ = Ogre::TextureManager::getSingleton().createManual(
                name, Ogre::RGN_DEFAULT, Ogre::TEX_TYPE_2D, color->getWidth(), color->getHeight(),
                0, color->getFormat(), Ogre::TU_RENDERTARGET);
        }
        ~TextureLikeColor() {
            guest().output.reset();
            Ogre::TextureManager::getSingleton().remove(texture_);
        }
        const Ogre::TexturePtr& operator*() const { return texture_; }

      private:
        Ogre::TexturePtr texture_;
    };

    static std::unique_ptr<host::Host> host_;
    static std::map<std::pair<bool, bool>, ImageF> truths_;
};

std::unique_ptr<host::Host> InOgre::host_;
std::map<std::pair<bool, bool>, ImageF> InOgre::truths_;

TEST_F(InOgre, MotionBlurIsNearGroundTruth) {
    expect_near_truth(kMotion);
}

TEST_F(InOgre, DepthOfFieldIsNearGroundTruth) {
    expect_near_truth(kLens);
}

TEST_F(InOgre, BothAreNearGroundTruth) {
    expect_near_truth(kBoth);
    expect_near_truth(kBalanced);
}

TEST_F(InOgre, WrongConventionsAreSeen) {
    const auto turn_x = [](pc_frame& frame) { frame.motion_scale[0] *= -1; };
    const auto turn_y = [](pc_frame& frame) { frame.motion_scale[1] *= -1; };
    const auto double_length = [](pc_frame& frame) {
        frame.motion_scale[0] *= 2;
        frame.motion_scale[1] *= 2;
    };
    const auto turn_rows = [](pc_frame& frame) { frame.flags ^= PC_TOP_LEFT; };
    const auto turn_depth = [](pc_frame& frame) { frame.depth_encoding = PC_DEPTH_REVERSE; };
    for (const Case* c : {&kMotion, &kBoth}) {
        expect_seen(*c, "velocity turned in x", turn_x);
        expect_seen(*c, "velocity turned in y", turn_y);
        expect_seen(*c, "velocity in pixels of half the size", double_length);
    }
    for (const Case* c : {&kLens, &kBoth}) expect_seen(*c, "rows from the bottom", turn_rows);
    for (const Case* c : {&kMotion, &kLens, &kBoth}) expect_seen(*c, "reverse depth", turn_depth);
}

// A lens whose points are turned by half a turn: the other side of the focus.
TEST_F(InOgre, WrongSignOfTheLensIsSeen) {
    const ImageF wrong = draw_truth(*host_, {.samples = kSamples,
                                             .frame = kFrame,
                                             .lens = true,
                                             .blades = 3,
                                             .rotation_deg = 20,
                                             .lens_sign = -1});
    EXPECT_LT(psnr(draw(kLens.chain), wrong), kLens.limit_db);
}

// Uniform motion blurs the same in both directions of time. The frame before tells them apart.
TEST_F(InOgre, VelocityPointsTheRightWay) {
    set_chain(nullptr);
    host_->draw(kFrame - 1);
    const TextureLikeColor before("before"), aside("aside");
    Ogre::TexturePtr to = *before;
    host_->plane(0)->copyToTexture(to);
    guest().output = *aside;  // color stays as the engine drew it
    set_chain(kMotion.chain);
    host_->draw(kFrame);
    ASSERT_EQ(guest().error(), "");

    pc_frame frame = guest().frame();
    pc_texture previous = frame.color;
    (*before)->getCustomAttribute("GLID", &previous.name);
    const auto check = [&](int x, int y) {
        int signs[2] = {};
        float margin = 0;
        ASSERT_EQ(pc_check_motion(guest().instance(), &frame, &previous, signs, &margin), PC_OK);
        EXPECT_EQ(signs[0], x);
        EXPECT_EQ(signs[1], y);
        EXPECT_GT(margin, 1.1f);
    };
    check(1, 1);
    frame.motion_scale[0] *= -1;
    check(-1, 1);
    frame.motion_scale[1] *= -1;
    check(-1, -1);
}

// The engine's frames are the same with the guest and without it.
TEST_F(InOgre, EngineDoesNotNoticeItsGuest) {
    const TextureLikeColor aside("aside");
    struct Drawn {
        Image<unsigned char> window;
        ImageF color, velocity, mask, depth;
        bool operator==(const Drawn&) const = default;
    };
    const auto film = [&](const char* chain) {
        set_chain(chain);
        guest().output = *aside;
        std::vector<Drawn> frames;
        for (int i = 0; i < 4; ++i) {
            host_->set_text("frame " + std::to_string(i));
            host_->draw(kFrame + i);
            EXPECT_EQ(guest().error(), "");
            frames.push_back({read_window(*host_), read_texture(host_->plane(0)),
                              read_texture(host_->plane(1)), read_texture(host_->plane(2)),
                              read_texture(host_->plane(3))});
        }
        return frames;
    };
    host_->motion_vectors().forget();
    const auto alone = film(nullptr);
    for (const char* chain : {kMotion.chain, kLens.chain, kBalanced.chain, kReport}) {
        host_->motion_vectors().forget();
        const auto together = film(chain);
        for (size_t i = 0; i < alone.size(); ++i)
            EXPECT_TRUE(together[i] == alone[i]) << chain << " frame " << i;
        EXPECT_FALSE(read_texture(*aside) == alone.back().color) << chain << ": did nothing";
    }
    EXPECT_FALSE(alone[2].window == alone[1].window);
}

// A compositor that runs the chain between two halves of the scene's objects, which are drawn with
// the same programs. This is the hardest case for an engine that caches GL state.
constexpr char kInTheMiddle[] = R"(
compositor Test/InTheMiddle
{
    technique
    {
        texture scene target_width target_height PF_FLOAT16_RGBA PF_FLOAT16_GR PF_L8 PF_DEPTH32F depth_pool 0
        target scene
        {
            input none
            pass clear
            {
                buffers colour depth
            }
            pass render_scene
            {
                last_render_queue 50
            }
            pass render_custom postchain
            {
                first_render_queue 51
                input 0 scene 0
                input 1 scene 1
                input 2 scene 2
                input 3 scene 3
            }
            pass render_scene
            {
                first_render_queue 51
            }
        }
        target_output
        {
            input none
            pass render_quad
            {
                material Host/ToneMap
                input 0 scene 0
            }
        }
    }
}
)";

TEST_F(InOgre, EngineDoesNotNoticeItsGuestBetweenTwoObjects) {
    auto& compositors = Ogre::CompositorManager::getSingleton();
    Ogre::DataStreamPtr script(
        new Ogre::MemoryDataStream(const_cast<char*>(kInTheMiddle), sizeof(kInTheMiddle) - 1));
    Ogre::ScriptCompilerManager::getSingleton().parseScript(script, Ogre::RGN_DEFAULT);
    Ogre::Viewport* viewport = host_->window().getViewport(0);
    ASSERT_NE(compositors.addCompositor(viewport, "Test/InTheMiddle"), nullptr);
    const auto use = [&](const char* name) {
        for (const char* each : {"Host/Frame", "Test/InTheMiddle"})
            compositors.setCompositorEnabled(viewport, each, std::string(each) == name);
    };
    const auto whole = [&] {
        draw(nullptr);
        return read_window(*host_);
    }();
    use("Test/InTheMiddle");
    int count = 0;
    for (const auto& [name, object] : host_->scene().manager().getMovableObjects("Entity"))
        object->setRenderQueueGroup(++count % 2 ? 50 : 60);
    const TextureLikeColor aside("aside");
    guest().output = *aside;
    for (const char* chain : {kMotion.chain, kLens.chain, kBalanced.chain, kReport}) {
        draw(chain);
        EXPECT_TRUE(read_window(*host_) == whole) << chain;
    }
    use("Host/Frame");
}

// The panel is opaque, so its pixels do not depend on the image under it.
TEST_F(InOgre, OverlayIsDrawnAfterTheChain) {
    const auto panel = [](const char* chain) {
        draw(chain);
        const auto window = read_window(*host_);
        std::vector<unsigned char> pixels;
        for (int y = 8; y < 52; ++y)
            pixels.insert(pixels.end(), window.pixel(8, y), window.pixel(8 + 176, y));
        return pixels;
    };
    host_->set_text("frame 31\nengine");
    const auto alone = panel(nullptr), blurred = panel(kBalanced.chain);
    EXPECT_TRUE(alone == blurred);
    const auto bright = std::count_if(alone.begin(), alone.end(), [](int v) { return v > 200; });
    EXPECT_GT(bright, 300);  // letters
    EXPECT_LT(bright, 6000);
    host_->set_text("");
    EXPECT_FALSE(panel(nullptr) == alone);
}

TEST_F(InOgre, FailureShowsTheEnginesOwnFrame) {
    draw(nullptr);
    const auto alone = read_window(*host_);
    set_chain(nullptr);
    host_->draw(kFrame - 1);
    set_chain(kBoth.chain);
    guest().adjust = [](pc_frame& frame) { frame.f_stop = 0; };
    host_->draw(kFrame);
    EXPECT_NE(guest().error().find("f_stop"), std::string::npos) << guest().error();
    EXPECT_TRUE(read_window(*host_) == alone);
}

// Depth is reversed in OGRE's clear, test and projection.
class InOgreReversed : public InOgre {
  protected:
    static void SetUpTestSuite() { open({.width = 480, .height = 270, .reverse_depth = true}); }
};

TEST_F(InOgreReversed, DepthIsNearGroundTruthToo) {
    expect_near_truth(kLens);
    expect_near_truth(kBoth);
    EXPECT_EQ(guest().frame().depth_encoding, uint32_t(PC_DEPTH_REVERSE));
    expect_seen(kLens, "forward depth",
                [](pc_frame& frame) { frame.depth_encoding = PC_DEPTH_FORWARD; });
}

}  // namespace
}  // namespace postchain
