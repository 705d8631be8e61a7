// The edited chain: undo, gestures, focus keys, and its file's text.
#include "tools/apps/view/document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "config/chain_file.h"
#include "passes/registry.h"
#include "tests/support/transcript.h"
#include "tools/apps/view/chain_text.h"
#include "tools/apps/view/messages.h"
#include "tools/apps/view/parameter_words.h"

namespace postchain::view {
namespace {

using testing::HasSubstr;
using testing::Not;

Document opened(const std::string& text) {
    ChainFile file = parse_chain(text, "chain.yaml", builtin_passes());
    EXPECT_TRUE(file.status().ok()) << text;
    return Document(builtin_passes(), std::move(file.chain));
}

const char* const kText = R"(# A chain with comments.
postchain: 1
camera:
  f_stop: 2.8   # wide open
  focus_distance: 3
passes:
  # First the lens.
  - depth_of_field: {samples: 16, method: inverse_warp}   # sixteen
  # Then the shutter,
  # with many samples.
  - motion_blur:
      # an odd number
      samples: 25
      mode: inverse_warp
  - fxaa
# The end.
)";

TEST(Document, UndoAndRedoLeadThroughEveryState) {
    Document document = opened(kText);
    const std::string first = document.chain().text();
    EXPECT_TRUE(document.set(0, "samples", int64_t(8)).ok());
    EXPECT_TRUE(document.move(2, 0).ok());
    EXPECT_TRUE(document.erase(1).ok());
    EXPECT_TRUE(document.add("fxaa", 1).ok());
    EXPECT_EQ(document.chain().types(), (std::vector<std::string>{"fxaa", "fxaa", "motion_blur"}));
    const std::string last = document.chain().text();
    EXPECT_EQ(document.undo_name(), "add fxaa");
    for (int i = 0; i < 4; ++i) document.undo();
    EXPECT_FALSE(document.can_undo());
    EXPECT_EQ(document.chain().text(), first);
    EXPECT_FALSE(document.changed());
    while (document.can_redo()) document.redo();
    EXPECT_EQ(document.chain().text(), last);
    EXPECT_TRUE(document.changed());
    document.undo();
    EXPECT_TRUE(document.switch_off(0, true).ok());
    EXPECT_FALSE(document.can_redo()) << "an edit ends what could be done again";
}

// All that a state has, and the file that it would be saved as.
std::string told(const Document& document) {
    const DocumentState& state = document.state();
    std::string text = concat(document.changed() ? "changed" : "as saved",
                              document.keys_changed() ? ", keys changed" : "", "; off");
    for (const bool off : state.off) text += off ? " 1" : " 0";
    text += "; id";
    for (const uint64_t id : state.id) text += concat(" ", id);
    text += "; keys";
    for (const auto& [frame, distance] : state.focus_keys)
        text += concat(" ", frame, ":", distance);
    return concat(text, "; focus at 15 ", document.camera_at(15).focus_distance.value_or(-1), "\n",
                  chain_file_text(kText, document).text);
}

TEST(Document, EveryEditAndItsUndo) {
    Document document = opened(kText);
    const auto other = [](const char* text) {
        return parse_chain(text, "", builtin_passes()).chain.clone();
    };
    const std::pair<const char*, std::function<Status()>> edits[] = {
        {"set", [&] { return document.set(1, "samples", int64_t(27)); }},
        {"set, matte", [&] { return document.set(0, "matte", std::string("hero")); }},
        {"set_in_all", [&] { return document.set_in_all("seed", int64_t(7)); }},
        {"set_camera", [&] { return document.set_camera("f_stop", 5.6); }},
        {"add", [&] { return document.add("joint_blur", 1); }},
        {"switch_off", [&] { return document.switch_off(3, true); }},
        {"move", [&] { return document.move(3, 0); }},
        {"reorder",
         [&] {
             return document.reorder({2, 0, 3, 1});
         }},
        {"switch_on", [&] { return document.switch_off(1, false); }},
        {"erase", [&] { return document.erase(2); }},
        {"a gesture",
         [&] {
             document.begin_gesture();
             const Status first = document.set_focus_key(10, 1);
             const Status second = document.set_focus_key(20, 2);
             document.end_gesture();
             return first.ok() ? second : first;
         }},
        {"remove_focus_key",
         [&] {
             document.remove_focus_key(10);
             return Status();
         }},
        {"take_passes",
         [&] {
             document.take_passes(other("postchain: 1\npasses: [fxaa, motion_blur]\n"), "other");
             return Status();
         }},
        {"replace", [&] {
             document.replace(other("postchain: 1\npasses: [fxaa: {preset: 39}]\n"), "reload");
             return Status();
         }}};
    const test::Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/view/expected");
    std::vector<std::string> states = {told(document)};
    std::vector<std::string> names;
    test::Transcript::say(states[0]);
    for (const auto& [name, edit] : edits) {
        const uint64_t revision = document.revision();
        const Status status = edit();
        ASSERT_TRUE(status.ok()) << name << ": " << status.message();
        EXPECT_GT(document.revision(), revision) << name;
        states.push_back(told(document));
        names.push_back(document.undo_name());
        test::Transcript::say(concat("# ", name, ": ", names.back()));
        std::istringstream before(states[states.size() - 2]), after(states.back());
        std::set<std::string> known;
        for (std::string line; std::getline(before, line);) known.insert(line);
        for (std::string line; std::getline(after, line);)
            if (!known.contains(line)) test::Transcript::say(line);
    }
    for (size_t i = states.size(); i-- > 1;) {
        EXPECT_EQ(document.undo_name(), names[i - 1]);
        document.undo();
        EXPECT_EQ(document.redo_name(), names[i - 1]);
        EXPECT_EQ(told(document), states[i - 1]);
    }
    for (size_t i = 1; i < states.size(); ++i) {
        document.redo();
        EXPECT_EQ(told(document), states[i]);
    }
}

// The oldest states are forgotten, and each name stays with its edit.
TEST(Document, UndoHasALimit) {
    Document document = opened(kText);
    for (int edit = 1; edit <= 505; ++edit)
        ASSERT_TRUE(document.set_camera(edit % 2 ? "f_stop" : "focus_distance", 3.0 + edit).ok());
    EXPECT_EQ(document.undo_name(), "camera.f_stop");
    document.undo();
    EXPECT_EQ(document.undo_name(), "camera.focus_distance");
    EXPECT_EQ(document.redo_name(), "camera.f_stop");
    EXPECT_EQ(document.chain().camera.f_stop, 3.0 + 503);
    int undone = 1;
    for (; document.can_undo(); ++undone) document.undo();
    EXPECT_EQ(undone, 499);
    EXPECT_EQ(document.chain().camera.focus_distance, 3.0 + 6);
    EXPECT_TRUE(document.changed()) << "the file's state is forgotten";
}

// Passes that are off stay off wherever they go.
TEST(Document, EditsOfTheListKeepWhatIsOff) {
    Document document = opened(kText);
    ASSERT_TRUE(document.switch_off(2, true).ok());
    using Off = std::vector<bool>;
    EXPECT_TRUE(document.add("joint_blur", 1).ok());
    EXPECT_EQ(document.chain().types(),
              (std::vector<std::string>{"depth_of_field", "joint_blur", "motion_blur", "fxaa"}));
    EXPECT_EQ(document.state().off, (Off{false, false, false, true}));
    EXPECT_EQ(document.state().id, (std::vector<uint64_t>{0, 3, 1, 2}));
    EXPECT_TRUE(document.erase(0).ok());
    EXPECT_EQ(document.state().off, (Off{false, false, true}));
    EXPECT_EQ(document.state().id, (std::vector<uint64_t>{3, 1, 2}));
    EXPECT_TRUE(document.move(2, 0).ok());
    EXPECT_EQ(document.state().off, (Off{true, false, false}));
    EXPECT_EQ(document.state().id, (std::vector<uint64_t>{2, 3, 1}));
    EXPECT_TRUE(document.move(0, 99).ok()) << "to the end";
    EXPECT_EQ(document.chain().types().back(), "fxaa");
    while (document.chain().links.size() < kMaxPasses) ASSERT_TRUE(document.add("fxaa", 99).ok());
    EXPECT_EQ(document.add("fxaa", 0).code(), StatusCode::chain);
    EXPECT_TRUE(document.orders().empty()) << "too many";
}

TEST(Document, AValueForAllPassesThatReadIt) {
    Document document = opened(
        "postchain: 1\npasses:\n  - motion_blur: {mode: guertin}\n"
        "  - joint_blur\n  - motion_blur\n  - fxaa\n");
    EXPECT_TRUE(document.set_in_all("path_px_per_time", 7.0).ok());
    for (const auto& [link, count] : {std::pair(0, false), {1, false}, {2, true}, {3, false}})
        EXPECT_EQ(document.chain().links[size_t(link)].text().find("path_px_per_time=7") !=
                      std::string::npos,
                  count)
            << link;
    EXPECT_EQ(document.undo_name(), "path_px_per_time");
}

TEST(Document, PassesOfAnotherChainKeepTheCamera) {
    Document document = opened(kText);
    const ChainFile other =
        parse_chain("postchain: 1\ncamera: {f_stop: 9}\npasses:\n  - fxaa\n", "", builtin_passes());
    document.take_passes(other.chain, "other");
    EXPECT_EQ(document.chain().types(), std::vector<std::string>{"fxaa"});
    EXPECT_EQ(document.chain().camera.f_stop, 2.8);
    // Edits that come back know which of the passes were there, each of them once.
    DocumentState state = document.state().clone();
    for (int i = 0; i < 2; ++i) state.chain.append(builtin_passes(), "fxaa");
    state.off = {false, true, false};
    document.restore(std::move(state));
    const auto& id = document.state().id;
    EXPECT_EQ(std::set<uint64_t>(id.begin(), id.end()).size(), 3u);
    EXPECT_EQ(id[0], 3u);
    EXPECT_TRUE(document.state().off[1]);
}

TEST(Document, PassesWithAValueOfTheirOwnAreNamed) {
    Document document = opened(
        "postchain: 1\npasses:\n  - depth_of_field: {f_stop: 4}\n  - motion_blur\n"
        "  - joint_blur: {f_stop: 2}\n");
    using Names = std::vector<std::string>;
    EXPECT_EQ(document.passes_with_own("f_stop"), (Names{"depth_of_field", "joint_blur"}));
    EXPECT_TRUE(document.switch_off(0, true).ok());
    EXPECT_EQ(document.passes_with_own("f_stop"), Names{"joint_blur"});
    EXPECT_EQ(document.passes_with_own("focus_distance"), Names());
}

TEST(Document, AGestureIsOneStep) {
    Document document = opened(kText);
    document.begin_gesture();
    for (const double stop : {3.0, 4.0, 5.6}) EXPECT_TRUE(document.set_camera("f_stop", stop).ok());
    document.end_gesture();
    EXPECT_TRUE(document.set_camera("f_stop", 8.0).ok());
    document.undo();
    EXPECT_EQ(document.chain().camera.f_stop, 5.6);
    document.undo();
    EXPECT_EQ(document.chain().camera.f_stop, 2.8);
    EXPECT_FALSE(document.can_undo());
}

TEST(Document, AFaultyValueChangesNothing) {
    Document document = opened(kText);
    const uint64_t revision = document.revision();
    const test::Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/view/expected");
    const auto told = [](const Status& status) {
        test::Transcript::say(status.message());
        return status;
    };
    EXPECT_EQ(told(document.set(0, "samples", int64_t(-1))).code(), StatusCode::chain);
    EXPECT_EQ(told(document.set(0, "sampels", int64_t(1))).code(), StatusCode::chain);
    EXPECT_EQ(told(document.set(9, "samples", int64_t(1))).code(), StatusCode::chain);
    EXPECT_EQ(told(document.set_camera("f_stop", -1.0)).code(), StatusCode::chain);
    EXPECT_EQ(told(document.add("no_such_pass", 0)).code(), StatusCode::chain);
    EXPECT_EQ(told(document.erase(3)).code(), StatusCode::chain);
    EXPECT_EQ(told(document.set_focus_key(1, 0)).code(), StatusCode::chain);
    for (const double none : {-1.0, std::nan(""), HUGE_VAL})
        EXPECT_EQ(told(document.set_focus_key(1, none)).code(), StatusCode::chain) << none;
    EXPECT_EQ(told(document.set_camera("aperture_image", std::string("/no/such.exr"))).code(),
              StatusCode::input);
    EXPECT_EQ(told(document.set(0, "matte_effect", std::string("unmoved"))).code(),
              StatusCode::chain);
    EXPECT_EQ(told(document.set_in_all("samples", int64_t(-1))).code(), StatusCode::chain);
    EXPECT_EQ(told(document.switch_off(3, true)).code(), StatusCode::chain);
    EXPECT_EQ(told(document.move(3, 0)).code(), StatusCode::chain);
    for (const auto& order : {std::vector<size_t>{0, 0, 1}, {0, 1}, {0, 1, 3}, {0, 1, 2, 3}})
        EXPECT_EQ(told(document.reorder(order)).code(), StatusCode::chain);
    EXPECT_TRUE(document.set(0, "samples", int64_t(16)).ok()) << "the value that it has";
    EXPECT_EQ(document.revision(), revision);
}

TEST(Document, TheCamerasValuesAndKeysCountForEveryPass) {
    const auto expect_no_own = [](const Document& document) {
        for (const ChainLink& link : document.chain().links)
            for (const char* own : {"focus_at=[", "focus_distance=4", "f_stop=4"})
                EXPECT_THAT(link.text(), Not(HasSubstr(own)));
    };
    Document document = opened(
        "postchain: 1\npasses:\n  - depth_of_field: {focus_at: [0.5, 0.5]}\n"
        "  - depth_of_field: {focus_distance: 4, f_stop: 4}\n");
    EXPECT_TRUE(document.set_camera("f_stop", 8.0).ok());
    EXPECT_TRUE(document.set_focus_key(10, 1).ok());
    expect_no_own(document);
    document.undo();
    EXPECT_TRUE(document.set_camera("focus_distance", 2.0).ok());
    expect_no_own(document);
    EXPECT_EQ(document.chain().camera.focus_distance, 2.0);
}

TEST(Document, KeysGiveEachFrameItsFocus) {
    EXPECT_DOUBLE_EQ(focus_at({{10, 1.0}, {20, 2.0}}, 15), 1 / 0.75) << "linear in 1/distance";
    EXPECT_DOUBLE_EQ(focus_at({{10, 1.0}, {20, 2.0}}, 5), 1);
    EXPECT_DOUBLE_EQ(focus_at({{10, 1.0}, {20, 2.0}}, 99), 2);
    Document document = opened(kText);
    EXPECT_TRUE(document.set_focus_key(10, 1).ok());
    EXPECT_TRUE(document.set_focus_key(20, 2).ok());
    EXPECT_EQ(document.chain_at(10).camera.focus_distance, 1.0);
    EXPECT_EQ(document.chain_at(20).camera.focus_distance, 2.0);
    EXPECT_FALSE(document.chain_to_save().camera.focus_distance);
    EXPECT_TRUE(document.keys_changed());
    document.keys_saved();
    document.saved();
    EXPECT_FALSE(document.keys_changed());
    document.undo();
    EXPECT_TRUE(document.keys_changed());
    document.undo();
    EXPECT_FALSE(document.keys_changed()) << "there are none";
    document.redo();
    document.redo();
    const uint64_t with_both = document.hash_at(15);
    EXPECT_NE(document.hash_at(20), with_both);
    document.remove_focus_key(20);
    EXPECT_EQ(document.chain_at(20).camera.focus_distance, 1.0);
    EXPECT_NE(document.hash_at(15), with_both);
    EXPECT_EQ(document.hash_at(15), document.hash_at(20));
    document.remove_focus_key(10);
    EXPECT_EQ(document.chain_at(10).camera.focus_distance, 3.0);
}

TEST(Document, OrdersThatLookTheSameAreListedOnce) {
    Document document = opened("postchain: 1\npasses:\n  - fxaa\n  - motion_blur\n  - fxaa\n");
    const auto list = document.orders();
    ASSERT_EQ(list.size(), 3u);
    EXPECT_EQ(list[0], (std::vector<size_t>{0, 1, 2})) << "the current one";
    EXPECT_EQ(document.name_of_order(list[1]), "fxaa > fxaa > motion_blur");
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(document.erase(0).ok());
    EXPECT_TRUE(document.orders().empty());
}

TEST(Document, PassesThatAreOffDoNotFilter) {
    Document document = opened(kText);
    EXPECT_TRUE(document.switch_off(1, true).ok());
    EXPECT_EQ(document.chain_at(0).types(), (std::vector<std::string>{"depth_of_field", "fxaa"}));
    EXPECT_EQ(document.chain().links.size(), 3u);
}

TEST(ChainText, EditsKeepCommentsAndOrder) {
    Document document = opened(kText);
    EXPECT_EQ(chain_file_text(kText, document).text, kText);
    EXPECT_TRUE(document.set(0, "samples", int64_t(64)).ok());
    EXPECT_TRUE(document.set(1, "samples", int64_t(27)).ok());
    EXPECT_TRUE(document.set(1, "shutter_frames", 0.25).ok());
    EXPECT_TRUE(document.set(2, "mode", std::string("directional")).ok());
    EXPECT_TRUE(document.set_camera("f_stop", 4.0).ok());
    EXPECT_TRUE(document.move(1, 0).ok());
    EXPECT_TRUE(document.add("fxaa", 3).ok());
    const ChainFileText saved = chain_file_text(kText, document);
    EXPECT_TRUE(saved.kept);
    EXPECT_EQ(saved.text, R"(# A chain with comments.
postchain: 1
camera:
  f_stop: 4   # wide open
  focus_distance: 3
passes:
  # Then the shutter,
  # with many samples.
  - motion_blur:
      # an odd number
      shutter_frames: 0.25
      samples: 27
      mode: inverse_warp
  # First the lens.
  - depth_of_field: {samples: 64, method: inverse_warp}   # sixteen
  - fxaa: {mode: directional}
  - fxaa
# The end.
)");
}

// Saves as the session does.
std::string save(const std::string& text, Document& document) {
    ChainFileText saved = chain_file_text(text, document);
    const ChainFile again = parse_chain(saved.text, "saved", builtin_passes());
    EXPECT_TRUE(again.status().ok()) << saved.text;
    EXPECT_EQ(again.chain.text(), document.chain_to_save().text()) << saved.text;
    document.saved(std::move(saved.off));
    EXPECT_FALSE(document.changed());
    return saved.text;
}

// Values are added where the others are, in braces or on lines.
TEST(ChainText, ValuesAreAddedInPlace) {
    const char* const text =
        "postchain: 1\ncamera: {f_stop: 2}  # wide\npasses:\n"
        "  - motion_blur: {samples: 9}  # nine\n  - fxaa  # plain\n"
        "  - depth_of_field:  # rows\n      samples: 16\n";
    Document document = opened(text);
    EXPECT_TRUE(document.set_camera("focus_distance", 3.0).ok());
    EXPECT_TRUE(document.set(0, "shutter_frames", 0.25).ok());
    EXPECT_TRUE(document.set(1, "mode", std::string("directional")).ok());
    EXPECT_TRUE(document.set(2, "f_stop", 4.0).ok());
    const ChainFileText saved = chain_file_text(text, document);
    EXPECT_TRUE(saved.kept);
    EXPECT_EQ(saved.text,
              "postchain: 1\ncamera: {focus_distance: 3, f_stop: 2}  # wide\npasses:\n"
              "  - motion_blur: {shutter_frames: 0.25, samples: 9}  # nine\n"
              "  - fxaa: {mode: directional}  # plain\n"
              "  - depth_of_field:  # rows\n      f_stop: 4\n      samples: 16\n");
}

// And removed: first, between, last, in braces or on lines, with what is added instead.
TEST(ChainText, ValuesAreRemovedInPlace) {
    const auto without = [](const std::string& text, std::initializer_list<const char*> keys) {
        Document document = opened("postchain: 1\n" + text);
        for (const char* key : keys)
            EXPECT_TRUE((camera_parameters().find(key) ? document.set_camera(key, {})
                                                       : document.set(0, key, {}))
                            .ok())
                << key;
        const ChainFileText saved = chain_file_text("postchain: 1\n" + text, document);
        EXPECT_EQ(write_chain(parse_chain(saved.text, "", builtin_passes()).chain),
                  write_chain(document.chain_to_save()));
        return (saved.kept ? "" : "anew: ") + saved.text.substr(13);
    };
    const std::string end = "passes:\n  # one\n  - fxaa  # last\n",
                      block = "camera:  # lens\n  f_stop: 2  # two\n  # far\n  focus_distance: 3\n";
    EXPECT_EQ(without(block + end, {"f_stop"}),
              "camera:  # lens\n  # far\n  focus_distance: 3\n" + end);
    EXPECT_EQ(without(block + end, {"focus_distance"}),
              "camera:  # lens\n  f_stop: 2  # two\n  # far\n" + end);
    EXPECT_EQ(without(block + end, {"f_stop", "focus_distance"}), "  # far\n" + end);
    for (const auto& [keys, left] : {std::pair(std::initializer_list<const char*>{"f_stop"},
                                               "focus_distance: 3, near_clip: 4"),
                                     {{"focus_distance"}, "f_stop: 2, near_clip: 4"},
                                     {{"near_clip"}, "f_stop: 2, focus_distance: 3"},
                                     {{"f_stop", "focus_distance"}, "near_clip: 4"}})
        EXPECT_EQ(
            without("camera: {f_stop: 2, focus_distance: 3, near_clip: 4}  # lens\n" + end, keys),
            concat("camera: {", left, "}  # lens\n", end));
    // What cannot be removed in place is written anew, and right.
    EXPECT_TRUE(without("camera: {f_stop: 2}\n" + end, {"f_stop"}).starts_with("anew: passes:"));
    EXPECT_TRUE(without("camera:\n  shutter_position: \n    start\n  f_stop: 2\n" + end,
                        {"shutter_position"})
                    .starts_with("anew: "));
    EXPECT_EQ(without("passes:\n  # one\n  - joint_blur:\n      max_radius_px: 9  # nine\n"
                      "      samples: 8  # eight\n",
                      {"max_radius_px"}),
              "passes:\n  # one\n  - joint_blur:\n      samples: 8  # eight\n");
}

TEST(ChainText, UndoAcrossASaveIsSaved) {
    Document document = opened(kText);
    EXPECT_TRUE(document.erase(0).ok());
    const std::string without = save(kText, document);
    document.undo();
    const std::string with = save(without, document);
    EXPECT_THAT(with, HasSubstr("  # with many samples.\n"));
    document.redo();
    EXPECT_EQ(save(with, document), without);

    Document other = opened(kText);
    EXPECT_TRUE(other.add("fxaa", 0).ok());
    const std::string added = save(kText, other);
    other.undo();
    EXPECT_EQ(save(added, other), kText);
    other.redo();
    EXPECT_EQ(save(kText, other), added);
}

TEST(ChainText, UndoOfAReloadIsSaved) {
    Document document = opened(kText);
    const std::string text = "postchain: 1\npasses:\n  - motion_blur\n";
    document.replace(parse_chain(text, "", builtin_passes()).chain.clone(), "reload");
    document.saved();
    document.undo();
    EXPECT_EQ(document.entry(0), -1);
    save(text, document);
    EXPECT_EQ(document.entry(2), 2);
}

TEST(ChainText, APassThatIsOffIsOneComment) {
    Document document = opened(kText);
    EXPECT_TRUE(document.switch_off(1, true).ok());
    const std::string once = save(kText, document);
    EXPECT_THAT(once, HasSubstr("#   - motion_blur:\n#       # an odd number\n"));
    EXPECT_EQ(save(once, document), once);
    EXPECT_TRUE(document.switch_off(1, false).ok());
    EXPECT_EQ(save(once, document), kText) << "its lines again";
    for (size_t i = 0; i < 3; ++i) EXPECT_TRUE(document.switch_off(i, true).ok());
    std::string none = chain_file_text(kText, document).text;
    EXPECT_EQ(std::count(none.begin(), none.end(), '#'), 1 + 3) << none;
    for (size_t i = 0; i < 3; ++i) EXPECT_TRUE(document.switch_off(i, false).ok());
    EXPECT_TRUE(document.switch_off(0, true).ok());
    EXPECT_TRUE(document.set(0, "samples", int64_t(5)).ok());
    const std::string changed = save(kText, document);
    EXPECT_THAT(changed, HasSubstr("\n#   - depth_of_field: {samples: 5"));
    EXPECT_TRUE(document.erase(0).ok());
    EXPECT_THAT(save(changed, document), Not(HasSubstr("depth_of_field")));
}

// Whatever the text is like, the saved one is the document's chain.
TEST(ChainText, EveryFormOfAFileIsSaved) {
    for (const std::string text :
         {"{\"postchain\": 1, \"passes\": [{\"fxaa\": {}}, \"motion_blur\"]}",
          "# top\npostchain: 1\npasses: [fxaa, motion_blur]\n",
          "postchain: 1\npasses:\n- fxaa\n- motion_blur: {samples:\n   9}\n",
          "passes:\n  - \"fxaa\"\n  - motion_blur\npostchain: 1\n",
          "# ä\npostchain: 1\npasses:\n  - fxaa\n  - motion_blur: {samples: 9} # ö\n",
          "postchain: 1\ncamera: {}\npasses:\n  - fxaa: {}\n  - motion_blur: {}\n",
          "postchain: 1\ncamera: {sensor_width_mm: 36,\n  f_stop: 2}\npasses:\n  - fxaa\n"
          "  - motion_blur: {shutter_frames: 0.5,\n      samples: 9}\n",
          "postchain: 1\r\npasses:\r\n  - fxaa\r\n  - motion_blur:\r\n      samples: 9\r\n"}) {
        Document document = opened(text);
        EXPECT_TRUE(document.set(1, "samples", int64_t(33)).ok());
        EXPECT_TRUE(document.move(0, 1).ok());
        EXPECT_TRUE(document.set_camera("f_stop", 1.5).ok());
        const std::string saved = save(text, document);
        EXPECT_EQ(saved.starts_with("# top\n"), text.starts_with("# top\n")) << saved;
    }
}

TEST(Messages, TheNewestFiftyAreKeptEachOnce) {
    Messages messages;
    for (int i = 1; i <= 60; ++i) messages.say("message " + std::to_string(i));
    ASSERT_EQ(messages.list().size(), 50u);
    EXPECT_EQ(messages.list().front().text, "message 11");
    messages.say("message 30", true);
    ASSERT_EQ(messages.list().size(), 50u);
    EXPECT_EQ(messages.list().back().text, "message 30");
    EXPECT_TRUE(messages.list().back().error);
    EXPECT_EQ(std::ranges::count(messages.list(), "message 30", &Message::text), 1);
}

TEST(Words, OfEveryParameter) {
    const test::Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/view/expected");
    for (const ParameterGroup& group : parameter_groups())
        test::Transcript::say(concat("group ", group.name, group.open ? ", open" : ""));
    std::set<std::string> said;  // many passes have the same row
    const auto say = [&](const ParameterTable& table) {
        for (const Parameter& row : table.rows()) {
            const ParameterWords words = words_of(row);
            const std::string line = concat(row.key, ": ", words.label, " in ", words.group,
                                            words.unset.empty() ? "" : "; unset: ", words.unset);
            if (said.insert(line).second) test::Transcript::say(line);
        }
    };
    for (const PassType& type : builtin_passes().types()) say(*type.parameters);
    say(camera_parameters());
}

TEST(Words, EveryParameterHasAGroup) {
    std::set<std::string> groups;
    for (const ParameterGroup& group : parameter_groups()) groups.insert(group.name);
    const auto check = [&](const ParameterTable& table, const std::string& name) {
        std::set<std::string> labels;
        for (const Parameter& row : table.rows()) {
            const ParameterWords words = words_of(row);
            EXPECT_TRUE(groups.contains(words.group)) << name << "." << row.key;
            const std::string all = words.label + ": " + words.unset;
            EXPECT_EQ(all.find('_'), std::string::npos) << all;
            EXPECT_EQ(all.find("--"), std::string::npos) << all;
            EXPECT_TRUE(labels.insert(words.label).second) << name << ": " << words.label;
            // Words that are neither keys nor options stay.
            std::istringstream text(as_keys(row.unset_means));
            size_t at = 0;
            for (std::string word; text >> word;) {
                if (word.find('_') != std::string::npos || word.starts_with("--")) continue;
                at = words.unset.find(word, at);
                ASSERT_NE(at, std::string::npos) << word << " of " << row.unset_means << all;
                at += word.size();
            }
        }
    };
    for (const PassType& type : builtin_passes().types()) check(*type.parameters, type.name);
    check(camera_parameters(), "camera");
}

}  // namespace
}  // namespace postchain::view
