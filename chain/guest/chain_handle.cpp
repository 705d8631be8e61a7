#include "chain/guest/chain_handle.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "chain/base/text.h"
#include "chain/pass/planner.h"

namespace postchain::guest {
namespace {

static_assert(kMaxPasses == PC_MAX_PASSES);

ParameterRef parameters_of(Chain& chain, uint32_t pass) {
    if (pass == PC_CAMERA) return ParameterRef(&chain.camera);
    return chain.links[pass].pass->parameters();
}

// Two values inside the usual range of a row, to find what a change of its value affects.
std::vector<ParameterValue> trials(const Parameter& row) {
    std::vector<ParameterValue> values;
    double low = std::max(row.soft_min, -1e3), high = std::min(row.soft_max, 1e3);
    if (low <= 0 && high >= 1e3) high = low + 10;
    switch (row.type) {
        case ParameterType::boolean:
            return {false, true};
        case ParameterType::choice:
            return {row.choices.begin(), row.choices.end()};
        case ParameterType::integer:
            if (!row.allowed.empty())
                return {row.allowed[row.allowed.size() / 3],
                        row.allowed[row.allowed.size() * 2 / 3]};
            for (const double part : {0.3, 0.6}) {
                auto value = int64_t(std::llround(low + part * (high - low)));
                if (row.odd) value |= 1;
                values.push_back(value);
            }
            return values;
        case ParameterType::number:
            return {low + 0.3 * (high - low), low + 0.6 * (high - low)};
        case ParameterType::point:
            return {std::array<double, 2>{0.4, 0.4}, std::array<double, 2>{0.6, 0.6}};
        case ParameterType::text:
            break;
    }
    return values;
}

// A frame on which every pass of the chain has work to do.
FrameDescription typical_frame(const Chain& chain) {
    FrameDescription frame;
    frame.width = frame.display_width = 640;
    frame.height = frame.display_height = 360;
    frame.planes = {Role::color, Role::inverse_depth, Role::motion};
    frame.without_mattes = true;
    frame.camera.focal_length_mm = 50;
    frame.camera.sensor_width_mm = 36;
    frame.camera.f_stop = 2;
    frame.camera.focus_distance = 4;
    for (const ChainLink& link : chain.links)
        for (const Place& place : link.pass->depth_places())
            frame.bounds.inverse_depth_at[place] = 0.25;
    return frame;
}

uint32_t difference(const Plan& a, const Plan& b) {
    if (a.textures != b.textures) return PC_COST_TEXTURE;
    if (a.steps.size() != b.steps.size()) return PC_COST_PROGRAM;
    for (size_t i = 0; i < a.steps.size(); ++i)
        if (!(a.steps[i].program == b.steps[i].program)) return PC_COST_PROGRAM;
    return PC_COST_UNIFORM;
}

}  // namespace

uint32_t cost_of(const Chain& chain, uint32_t pass, const Parameter& row) {
    std::vector<Plan> plans;
    if (auto plan = make_plan(chain, typical_frame(chain)); plan.ok())
        plans.push_back(std::move(*plan));
    for (const auto& value : trials(row)) {
        Chain trial = chain.clone();
        if (!row.check(value).ok()) continue;
        row.set(parameters_of(trial, pass), value);
        if (auto plan = make_plan(trial, typical_frame(trial)); plan.ok())
            plans.push_back(std::move(*plan));
    }
    uint32_t cost = PC_COST_UNIFORM;
    for (size_t i = 1; i < plans.size(); ++i) cost = std::max(cost, difference(plans[0], plans[i]));
    return cost;
}

std::vector<std::pair<uint32_t, const Parameter*>> samples_of(const Chain& chain) {
    std::vector<std::pair<uint32_t, const Parameter*>> found;
    for (uint32_t pass = 0; pass < chain.links.size(); ++pass) {
        const ChainLink& link = chain.links[pass];
        for (const Parameter& row : link.type->parameters->rows())
            if (row.key == "samples" &&
                link.type->parameters->unread(row, link.pass->parameters()).empty())
                found.emplace_back(pass, &row);
    }
    return found;
}

uint64_t ChainHandle::new_revision() {
    static std::atomic<uint64_t> last = 0;
    return ++last;
}

ChainHandle::ChainHandle(Chain chain) : chain_(std::make_shared<Chain>(std::move(chain))) {
    static std::atomic<uint64_t> last = 0;
    id_ = std::make_shared<const uint64_t>(++last);
    auto& links = chain_->links;
    if (std::all_of(links.begin(), links.end(), [](auto& link) { return link.matte.empty(); }))
        for (ChainLink& link : links) link.matte = kMask;
    const auto add = [&](uint32_t pass, const ParameterTable& table) {
        for (const Parameter& parameter : table.rows()) {
            Row row{pass, &parameter, {}, {}};
            for (const auto& choice : parameter.choices) row.choices.push_back(choice.c_str());
            rows_.push_back(std::move(row));
        }
    };
    for (size_t i = 0; i < chain_->links.size(); ++i)
        add(uint32_t(i), *chain_->links[i].type->parameters);
    add(PC_CAMERA, camera_parameters());
}

Result<Chain> ChainHandle::parse(std::string_view names) {
    std::vector<std::string> known;
    for (const auto& type : passes().types()) known.push_back(type.name);
    if (names.find_first_not_of(' ') == std::string_view::npos)
        return Status(StatusCode::chain, "no pass; known are " + joined(known));
    Chain chain;
    for (size_t first = 0, end = 0; end < names.size(); first = end + 1) {
        end = std::min(names.find(',', first), names.size());
        std::string_view name = names.substr(first, end - first);
        while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
        while (!name.empty() && name.back() == ' ') name.remove_suffix(1);
        if (name.empty())
            return Status(StatusCode::chain,
                          concat("\"", names, "\": a name is empty; remove a comma"));
        if (chain.links.size() == kMaxPasses)
            return Status(StatusCode::chain,
                          concat("more than ", kMaxPasses, " passes; split the chain into two"));
        if (chain.append(passes(), name)) continue;
        const std::string near = nearest_word(name, known);
        return Status(StatusCode::chain, concat("unknown pass \"", name, "\"; ",
                                                near.empty() ? "" : "did you mean " + near + "? ",
                                                "known are ", joined(known)));
    }
    return chain;
}

const ParameterTable* ChainHandle::table_of(uint32_t pass) const {
    if (pass == PC_CAMERA) return &camera_parameters();
    return pass < chain_->links.size() ? chain_->links[pass].type->parameters : nullptr;
}

Chain& ChainHandle::own() {
    chain_ = std::make_shared<Chain>(chain_->clone());
    return *chain_;
}

Failure ChainHandle::no_such_pass(uint32_t pass) const {
    return {PC_ERROR_ARGUMENT,
            concat("pass ", pass, ": the chain has ", chain_->links.size(), " passes, from 0")};
}

Failure ChainHandle::set(uint32_t pass, std::string_view key, const ParameterValue& value) {
    const ParameterTable* table = table_of(pass);
    if (!table) return no_such_pass(pass);
    const std::string place = pass == PC_CAMERA ? "camera" : chain_->links[pass].type->name;
    const Parameter* row = table->find(key);
    if (row && row->type == ParameterType::text && !std::holds_alternative<std::monostate>(value))
        return {PC_ERROR_CHAIN, concat(place, ".", key,
                                       ": this library does not read files; set the image of the "
                                       "aperture with pc_chain_set_aperture()")};
    const ParameterRef values = parameters_of(own(), pass);
    const ParameterValue before = row ? row->get(values) : ParameterValue();
    if (Status s = table->set(values, key, value); !s.ok()) return s.at(place);
    if (Status s = table->check(values); !s.ok()) {
        row->set(values, before);
        return s.at(place);
    }
    revision_ = new_revision();
    for (Row& known : rows_) known.cost = -1;
    return {};
}

Failure ChainHandle::set_number(uint32_t pass, std::string_view key, double value) {
    const ParameterTable* table = table_of(pass);
    const Parameter* row = table ? table->find(key) : nullptr;
    if (row && row->type == ParameterType::boolean && (value == 0 || value == 1))
        return set(pass, key, value == 1);
    if (row && row->type == ParameterType::integer && value == std::floor(value) &&
        std::abs(value) < 1e15)
        return set(pass, key, int64_t(value));
    return set(pass, key, value);
}

Failure ChainHandle::set_aperture(const float* values) {
    const size_t count = size_t(BokehKernel::kSide) * size_t(BokehKernel::kSide);
    auto image = BokehKernel::make(std::vector<float>(values, values + count));
    if (!image.ok()) return image.status().at("aperture");
    own().camera.aperture_image = std::move(*image);
    revision_ = new_revision();
    return {};
}

Failure ChainHandle::set_mask(uint32_t pass, pc_mask_effect effect) {
    if (pass >= chain_->links.size()) return no_such_pass(pass);
    if (effect > PC_MASK_IGNORED)
        return {PC_ERROR_ARGUMENT, concat("effect: ", effect, " is not a PC_MASK value")};
    ChainLink changed = chain_->links[pass].clone();
    changed.matte = effect == PC_MASK_IGNORED ? "" : kMask;
    changed.matte_effect.reset();
    if (effect == PC_MASK_UNMOVED) changed.matte_effect = MatteEffect::unmoved;
    if (Status s = changed.check_matte(); !s.ok()) return s.at(changed.type->name);
    own().links[pass] = std::move(changed);
    revision_ = new_revision();
    for (Row& known : rows_) known.cost = -1;
    return {};
}

Failure ChainHandle::describe(uint32_t index, pc_parameter& out) {
    if (index >= rows_.size())
        return {PC_ERROR_ARGUMENT, concat("parameter ", index, ": there are ", rows_.size())};
    Row& row = rows_[index];
    const Parameter& parameter = *row.parameter;
    const ParameterValue value = parameter.get(parameters_of(*chain_, row.pass));
    // Texts that a host has stay where they are.
    if (std::string text = text_of(value); text != row.text) row.text = std::move(text);
    if (row.cost < 0) row.cost = int(cost_of(*chain_, row.pass, parameter));
    out.pass = row.pass;
    out.pass_name = row.pass == PC_CAMERA ? "camera" : chain_->links[row.pass].type->name.c_str();
    out.key = parameter.key.c_str();
    out.type = name_of(parameter.type);
    out.unit = parameter.unit.c_str();
    out.help = parameter.help.c_str();
    out.choices = row.choices.data();
    out.choice_count = uint32_t(row.choices.size());
    out.is_set = !std::holds_alternative<std::monostate>(value);
    out.min = parameter.min;
    out.max = parameter.max;
    out.soft_min = parameter.soft_min;
    out.soft_max = parameter.soft_max;
    out.value = 0;
    if (const auto* flag = std::get_if<bool>(&value)) out.value = *flag;
    if (const auto* integer = std::get_if<int64_t>(&value)) out.value = double(*integer);
    if (const auto* number = std::get_if<double>(&value)) out.value = *number;
    out.text = row.text.c_str();
    out.cost = uint32_t(row.cost);
    out.reserved = 0;
    return {};
}

}  // namespace postchain::guest
