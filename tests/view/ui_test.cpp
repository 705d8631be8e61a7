// The widgets, by mouse and key.
#include <regex>

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

TEST_F(UiTest, NumbersAreSavedWithTheDigitsThatAreShown) {
    start();
    settle();
    EXPECT_EQ(shortest_double(0.941f), 0.941);
    EXPECT_NE(double(0.941f), 0.941);
    move_to("f_stop", 0.2);
    button(true);
    for (const double at : {0.3, 0.35, 0.41}) move_to("f_stop", at);
    button(false);
    move_to("shutter_frames", 0.1);
    button(true);
    move_to("shutter_frames", 0.317);
    button(false);
    ASSERT_TRUE(session_->save_chain(path("chain.yaml"), false).ok());
    const std::string text = test::read_text(path("chain.yaml"));
    EXPECT_NE(text, kJoint);
    EXPECT_FALSE(std::regex_search(text, std::regex(R"(\d\.\d{7})"))) << text;
    EXPECT_TRUE(focus_at_pixel(*session_, 0, 0).ok());
    EXPECT_EQ(session_->document().chain().camera.focus_distance, 6.0);
}

TEST_F(UiTest, ClosingNeverLosesEditsByAccident) {
    start();
    EXPECT_TRUE(session_->document().set_camera("f_stop", 4.0).ok());
    ui_->ask_to_close();
    draw(3);
    ui_->ask_to_close();
    draw(3);
    EXPECT_FALSE(ui_->wants_to_close()) << "the second Alt+F4 asks too";
    EXPECT_TRUE(has("close without saving"));
    key(kEscape);
    EXPECT_FALSE(ui_->is_asking());
    draw(3);
    EXPECT_FALSE(has("close without saving"));
    ui_->ask_to_close();
    draw(3);
    key(kEnter);
    EXPECT_TRUE(ui_->wants_to_close());
    EXPECT_NE(test::read_text(path("chain.yaml")).find("f_stop: 4"), std::string::npos);
}

TEST_F(UiTest, ClosingWithoutSavingLeavesTheFile) {
    settings_.recovery_folder = path("state");
    start();
    EXPECT_TRUE(session_->document().set_camera("f_stop", 4.0).ok());
    ASSERT_TRUE(wait_for([&] { return std::filesystem::exists(path("state")); }));
    ui_->ask_to_close();
    draw(3);
    click("close without saving");
    EXPECT_TRUE(ui_->wants_to_close());
    EXPECT_EQ(test::read_text(path("chain.yaml")), kJoint);
    ui_.reset();
    session_.reset();
    EXPECT_TRUE(std::filesystem::is_empty(path("state"))) << "nothing comes back";
}

}  // namespace
}  // namespace postchain::view
