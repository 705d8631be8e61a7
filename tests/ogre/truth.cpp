#include "tests/ogre/truth.h"

#include <gtest/gtest.h>
#include <postchain/chain_from_text.h>

#include <cmath>
#include <numbers>

#include "tools/metrics/compare.h"

namespace postchain {

namespace {

// Van der Corput: the digits of `i` mirrored at the point, in 0..1.
double halton(int i, int base) {
    double value = 0, digit = 1;
    for (; i > 0; i /= base) value += (digit /= base) * (i % base);
    return value;
}

struct Point {
    double right, up;
};

bool inside(const Point& p, const TruthSettings& settings) {
    if (settings.blades < 3) return p.right * p.right + p.up * p.up <= 1;
    const double step = 2 * std::numbers::pi / settings.blades;
    const double first = (180.0 / settings.blades + settings.rotation_deg) * std::numbers::pi / 180;
    for (int i = 0; i < settings.blades; ++i) {
        const double middle = first + (i + 0.5) * step;
        if (p.right * std::cos(middle) + p.up * std::sin(middle) > std::cos(step / 2)) return false;
    }
    return true;
}

// A point of the aperture, in radii: the next point of the square that is inside.
Point lens_sample(int& next, const TruthSettings& settings) {
    for (;;) {
        ++next;
        const Point p = {2 * halton(next, 2) - 1, 2 * halton(next, 3) - 1};
        if (inside(p, settings)) return p;
    }
}

}  // namespace

ImageF draw_truth(host::Host& host, const TruthSettings& settings) {
    const host::Lens& lens = host.postchain().lens;
    const double radius =
        lens.focal_length_mm(host.scene().camera()) / lens.f_stop / 2 / 1000 / lens.meters_per_unit;
    ImageD sum;
    int next = 0;
    for (int i = 0; i < settings.samples; ++i) {
        const double u = (i + 0.5) / settings.samples - 0.5;
        host.scene().pose(settings.frame + (settings.shutter ? u * lens.shutter_frames : 0));
        if (settings.lens) {
            const Point p = lens_sample(next, settings);
            host.scene().look_from(float(settings.lens_sign * radius * p.right),
                                   float(settings.lens_sign * radius * p.up), lens.focus_distance);
        }
        host.draw();
        const ImageF drawn = read_texture(host.plane(0));
        if (sum.empty()) sum = ImageD(drawn.width, drawn.height, drawn.channels);
        for (size_t k = 0; k < sum.data.size(); ++k) sum.data[k] += drawn.data[k];
    }
    for (double& value : sum.data) value /= settings.samples;
    return image_cast<float>(sum);
}

pc_chain* set_chain(host::PostchainPass& guest, const char* text) {
    pc_chain* chain = nullptr;
    if (text != nullptr) {
        EXPECT_EQ(pc_chain_from_text(text, "test", &chain), PC_OK) << pc_error();
    }
    guest.set_chain(chain);
    return chain;
}

ImageF read_texture(const Ogre::TexturePtr& texture) {
    const uint32_t width = texture->getWidth(), height = texture->getHeight();
    const bool depth = Ogre::PixelUtil::isDepth(texture->getFormat());
    ImageF image(int(width), int(height), depth ? 1 : 4);
    texture->getBuffer()->blitToMemory(Ogre::PixelBox(
        width, height, 1, depth ? Ogre::PF_DEPTH32F : Ogre::PF_FLOAT32_RGBA, image.data.data()));
    return image;
}

Image<unsigned char> read_window(host::Host& host) {
    const uint32_t width = host.window().getWidth(), height = host.window().getHeight();
    Image<unsigned char> image(int(width), int(height), 3);
    host.window().copyContentsToMemory(
        Ogre::Box(0, 0, width, height),
        Ogre::PixelBox(width, height, 1, Ogre::PF_BYTE_RGB, image.data.data()));
    return image;
}

double psnr(const ImageF& picture, const ImageF& truth) {
    const auto pair = metrics::pair_of(picture, truth);
    metrics::CompareSettings settings;
    settings.metrics = {"psnr"};
    return metrics::compare(pair.value(), settings).value().value("psnr").value();
}

}  // namespace postchain
