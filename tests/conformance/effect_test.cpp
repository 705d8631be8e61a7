// No parameter is without effect: under every combination of the values that ParameterTable::unread
// judges by, changing a row that is read changes the image for some value, and changing a row that
// is declared unread changes no bit. Both by running.
#include <algorithm>
#include <deque>
#include <set>

#include "chain/pass/depth_at.h"
#include "tests/conformance/conformance.h"

namespace postchain::effect_test {
namespace {

using Values = std::map<std::string, ParameterValue>;

class Effect : public Conformance {
  protected:
    // Small, with all that a pass can read: neighbors, a hint, a lens with blades, what is occluded
    // and much that is out of focus.
    static test::TestFrame make_frame() {
        test::TestFrame frame = test::layered_frame(48, 40, {23.0f, -11.0f}, {-3.0f, 5.0f}, 5);
        ImageF& depth = frame.planes.at(Role::inverse_depth);
        ImageF& motion = frame.planes.at(Role::motion);
        // Samples of highlights disagree.
        ImageF& color = frame.planes.at(Role::color);
        for (size_t i = 0; i < color.pixels(); i += 7)
            for (size_t c = 0; c < 3; ++c) color.data[4 * i + c] *= 30;
        ImageF hint(48, 40, 2);
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 48; ++x) {
                // A slope of slow and fast pixels, of near and far ones.
                if (depth.at(x, y) < 0.2f) depth.at(x, y) = 0.004f * float(y + 1);
                if (x > 40) depth.at(x, y) = 2;
                motion.at(x, y, 0) += 0.05f * float(x) - 1.0f;
                motion.at(x, y, 1) -= 0.3f * float(y) - 3.0f;
                hint.at(x, y, 0) = x > 20 ? (x > 30 ? 1.0f : 0.5f) : 0.0f;
                hint.at(x, y, 1) = y > 15 ? (y > 25 ? 1.0f : 0.5f) : 0.0f;
            }
        frame.planes[Role::motion_back] = frame.planes.at(Role::motion);
        for (float& value : frame.planes.at(Role::motion_back).data) value *= 0.8f;
        frame.planes[Role::hint] = std::move(hint);
        const Camera camera = frame.description.camera;
        frame.description = test::describe(frame.planes);
        test::add_neighbors(frame);
        frame.description.frame_number = 7;
        frame.description.camera = camera;
        Camera& lens = frame.description.camera;
        lens.f_stop = 0.05;
        lens.focus_distance = 9;
        lens.shutter_frames = 1;
        lens.aperture_blades = 5;
        return frame;
    }
    static const test::TestFrame& frame() {
        static const test::TestFrame made = make_frame();
        return made;
    }

    // Limits that suit so small a frame.
    static Values suited() {
        return {{"max_blur_px", int64_t(10)},
                {"max_radius_px", 8.0},
                {"max_near_fraction", 0.15},
                {"max_far_fraction", 0.15}};
    }

    // Values of the rows that some row's effect depends on: those that conditions name, and one
    // that they do not.
    static std::vector<ParameterValue> cases_of(const ParameterTable& table, const Parameter& row) {
        std::set<std::string> named;
        for (const Parameter& other : table.rows())
            for (const auto& all : other.read_if)
                for (const RowValue& condition : all)
                    if (condition.key == row.key)
                        named.insert(condition.values.begin(), condition.values.end());
        std::vector<ParameterValue> cases, rest;
        for (const ParameterValue& value : candidates(row)) {
            const bool is_named = named.contains(text_of(value));
            if (is_named || rest.empty()) (is_named ? cases : rest).push_back(value);
        }
        cases.insert(cases.end(), rest.begin(), rest.end());
        return cases;
    }

    // Values that differ, the default first.
    static std::vector<ParameterValue> candidates(const Parameter& row) {
        std::vector<ParameterValue> values = {row.default_value};
        const auto add = [&](const ParameterValue& value) {
            if (row.check(value).ok() && std::ranges::find(values, value) == values.end())
                values.push_back(value);
        };
        const double low = std::max(row.soft_min, -4.0), high = std::min(row.soft_max, 100.0);
        switch (row.type) {
            case ParameterType::boolean:
                add(true);
                add(false);
                break;
            case ParameterType::choice:
                for (const auto& word : row.choices) add(word);
                break;
            case ParameterType::integer:
                for (const int64_t value : row.allowed) add(value);
                for (const int64_t value : {int64_t(low), int64_t(2), int64_t(3), int64_t(6),
                                            int64_t(low + high) / 2 | 1, int64_t(high)})
                    add(value);
                break;
            case ParameterType::number:
                for (const double value :
                     {0.0, row.min, low + 0.1 * (high - low), low + 0.5 * (high - low), high, 1.0,
                      std::min(row.max, 100.0)})
                    add(value);
                break;
            case ParameterType::point:
                add(std::array{0.1, 0.1});
                add(std::array{0.5, 0.5});
                break;
            case ParameterType::text:
                break;
        }
        if (row.optional) add(std::monostate());
        return values;
    }

    // The image, or nothing if the pass cannot run with these values. A plan runs once: the same
    // steps have the same result (Conformance.SameBitsOnEveryRun).
    const ImageF* image_of(const Values& values, bool cut) {
        Chain one = chain();
        const PassType& type = GetParam();
        Pass& pass = *one.links[0].pass;
        std::set<std::string> excluded;  // by values that are set
        for (const auto& [key, value] : values)
            if (const Parameter* row = type.parameters->find(key);
                row && !(value == ParameterValue()))
                excluded.insert(row->excludes);
        Values all = values;
        for (const auto& value : suited())
            if (!excluded.contains(value.first)) all.insert(value);
        for (const auto& [key, value] : all)
            if (const Parameter* row = type.parameters->find(key))
                row->set(pass.parameters(), value);
        // By the values, not by text(), which leaves out what is unread.
        std::string name = cut ? "cut " : "";
        for (const Parameter& row : type.parameters->rows())
            name += text_of(row.get(pass.parameters())) + " ";
        const auto known = images_.find(name);
        if (known != images_.end()) return known->second;
        const ImageF*& image = images_[name];
        if (!type.parameters->check(pass.parameters()).ok()) return nullptr;
        FrameDescription description = frame().description;
        description.bounds.camera_cut = cut;
        find_depths(one, frame().planes, description);
        auto plan = make_plan(one, description, {});
        if (!plan.ok()) return nullptr;
        const auto same = std::ranges::find_if(runs_, [&](const Run& run) {
            return run.plan.steps == plan->steps && run.plan.textures == plan->textures &&
                   run.plan.outputs == plan->outputs;
        });
        if (same != runs_.end()) return image = &same->image;
        auto result = test::executor().filter(*plan, frame().planes);
        EXPECT_TRUE(result.ok()) << result.status().message();
        if (!result.ok()) return nullptr;
        runs_.push_back({std::move(*plan), std::move(result->at(Role::color))});
        return image = &runs_.back().image;
    }

    // Whether some value of the row changes the image.
    bool has_effect(const Parameter& row, Values values) {
        const std::vector<ParameterValue> all = candidates(row);
        for (const bool cut : {false, true}) {
            const ImageF* first = nullptr;
            for (const ParameterValue& value : all) {
                values[row.key] = value;
                const ImageF* image = image_of(values, cut);
                if (!image) continue;
                if (first && !test::equal_bits(*first, *image)) return true;
                first = image;
            }
        }
        return false;
    }

    struct Run {
        Plan plan;
        ImageF image;
    };
    std::deque<Run> runs_;
    std::map<std::string, const ImageF*> images_;  // by values, into runs_
};

// Every combination of the values of these rows.
std::vector<Values> combinations(
    const std::vector<std::pair<std::string, std::vector<ParameterValue>>>& rows) {
    std::vector<Values> all = {{}};
    for (const auto& [key, cases] : rows) {
        std::vector<Values> next;
        for (const Values& one : all)
            for (const ParameterValue& value : cases) {
                next.push_back(one);
                next.back()[key] = value;
            }
        all = std::move(next);
    }
    return all;
}

TEST_P(Effect, OfEveryParameterIsAsDeclaredInEveryMode) {
    const ParameterTable& table = *GetParam().parameters;
    // Modes: choices that decide for other rows. What else decides for a row is tried with it.
    std::set<std::string> modes;
    for (const Parameter& row : table.rows())
        for (const auto& all : row.read_if)
            for (const RowValue& condition : all)
                if (table.find(condition.key)->type == ParameterType::choice)
                    modes.insert(condition.key);
    int read = 0;
    for (const Parameter& row : table.rows()) {
        if (row.type == ParameterType::text) continue;
        std::set<std::string> keys = modes;
        for (const auto& all : row.read_if)
            for (const RowValue& condition : all) keys.insert(condition.key);
        keys.erase(row.key);
        std::vector<std::pair<std::string, std::vector<ParameterValue>>> cases;
        for (const std::string& key : keys)
            cases.emplace_back(key, cases_of(table, *table.find(key)));
        for (const Values& values : combinations(cases)) {
            Chain one = chain();
            const ParameterRef parameters = one.links[0].pass->parameters();
            std::string context;
            for (const auto& [key, value] : values) {
                table.find(key)->set(parameters, value);
                context += " " + key + "=" + text_of(value);
            }
            const std::string why = table.unread(row, parameters);
            const bool acts = has_effect(row, values);
            EXPECT_EQ(acts, why.empty()) << row.key << " with" << context << ": " << why;
            read += acts;
        }
    }
    EXPECT_GT(read, 0);
}

FOR_EVERY_PASS(Effect);

}  // namespace
}  // namespace postchain::effect_test
