#include "tools/sequence/image/contact_sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace postchain::io {
namespace {

using testing::ElementsAre;

TEST(ContactSheet, PicturesAreShrunkByABox) {
    ImageF picture(3, 2, 1);
    picture.data = {0, 3, 9, 0, 3, std::numeric_limits<float>::quiet_NaN()};
    // A pixel covers one and a half: (0 + 3 / 2) / 1.5 and (3 / 2 + 9) / 1.5; NaN counts as 0.
    EXPECT_THAT(shrunk(picture, 2, 2).data, ElementsAre(1, 7, 1, 1));
    EXPECT_THAT(shrunk(picture, 3, 1).data, ElementsAre(0, 3, 4.5f));
}

TEST(ContactSheet, FramesAreChosenEvenlyWithTheFirstAndTheLast) {
    EXPECT_THAT(evenly_chosen(10, 4), ElementsAre(0, 3, 6, 9));
    EXPECT_THAT(evenly_chosen(3, 5), ElementsAre(0, 1, 2));
    EXPECT_THAT(evenly_chosen(5, 1), ElementsAre(0));
    EXPECT_THAT(evenly_chosen(0, 3), ElementsAre());
}

}  // namespace
}  // namespace postchain::io
