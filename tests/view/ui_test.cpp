// The widgets, by mouse and key.
#include "tests/view/ui_fixture.h"

namespace postchain::view {
namespace {

TEST_F(UiTest, AChainWithoutPassesHasNoOrders) {
    start();
    while (!session_->document().chain().links.empty())
        EXPECT_TRUE(session_->document().erase(0).ok());
    draw();
    click("order");
    draw(3);
    EXPECT_FALSE(has("order "));
}

TEST_F(UiTest, AnInheritedValueIsShownAndAnOwnOneMarked) {
    start();
    settle();
    draw(2);
    EXPECT_FALSE(has("overridden f_stop"));
    EXPECT_TRUE(session_->document().set(0, "f_stop", 4.0).ok());
    draw(2);
    EXPECT_TRUE(has("overridden f_stop"));
}

}  // namespace
}  // namespace postchain::view
