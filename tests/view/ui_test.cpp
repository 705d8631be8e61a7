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

}  // namespace
}  // namespace postchain::view
