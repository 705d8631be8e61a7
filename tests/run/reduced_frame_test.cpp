// Reduction of frames.
#include "tools/sequence/source/reduced_frame.h"

#include <gtest/gtest.h>

#include "tools/sequence/image/contact_sheet.h"

namespace postchain::sequence {
namespace {

ImageF row(std::vector<float> values) {
    ImageF image(int(values.size()), 1, 1);
    image.data = std::move(values);
    return image;
}

TEST(Reduced, AMeanIsOfWhatAPixelCovers) {
    EXPECT_EQ(io::shrunk(row({1, 3, 5, 7}), 2, 1).data, (std::vector<float>{2, 6}));
    // Each of two pixels covers one and a half of three.
    const ImageF thirds = io::shrunk(row({3, 6, 12}), 2, 1);
    EXPECT_NEAR(thirds.data[0], (3 + 6 * 0.5) / 1.5, 1e-6);
    EXPECT_NEAR(thirds.data[1], (6 * 0.5 + 12) / 1.5, 1e-6);
    ImageF block(2, 2, 2);
    block.data = {1, 10, 2, 20, 3, 30, 6, 40};
    const ImageF one = io::shrunk(block, 1, 1);
    EXPECT_NEAR(one.at(0, 0, 0), 3, 1e-6);
    EXPECT_NEAR(one.at(0, 0, 1), 25, 1e-6);
}

TEST(Reduced, DepthsAreNeverMixed) {
    EXPECT_EQ(middle_reduced(row({1, 3, 5, 7, 9}), 1, 1).data, (std::vector<float>{5}));
    EXPECT_EQ(middle_reduced(row({1, 3, 5, 7}), 2, 1).data, (std::vector<float>{3, 7}));
}

}  // namespace
}  // namespace postchain::sequence
