#include "tools/apps/view/chain_panel.h"

#include <imgui_stdlib.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "config/chain_find.h"
#include "passes/common/shutter.h"
#include "tools/apps/view/parameter_words.h"
#include "tools/apps/view/session_values.h"

namespace postchain::view {
namespace {

constexpr float kInheritedAlpha = 0.55f;
const ImVec4 kOverridden = {0.95f, 0.78f, 0.45f, 1};

double number_of(const ParameterValue& value) {
    if (const auto* whole = std::get_if<int64_t>(&value)) return double(*whole);
    if (const auto* number = std::get_if<double>(&value)) return *number;
    return 0;
}

bool number_widget(const Parameter& row, const ParameterValue& now, ParameterValue& value) {
    const bool whole = row.type == ParameterType::integer;
    const bool bounded = std::isfinite(row.soft_min) && std::isfinite(row.soft_max);
    const ImGuiSliderFlags logarithmic =
        bounded && row.soft_min > 0 && row.soft_max / row.soft_min > 50
            ? ImGuiSliderFlags_Logarithmic
            : ImGuiSliderFlags_None;
    const std::string unit = row.unit.empty() ? "" : " " + row.unit;
    const TypesOnDoubleClick types;
    if (whole) {
        int number = int(number_of(now));
        const std::string format = "%d" + unit;
        const bool changed = bounded
                                 ? ImGui::SliderInt("##value", &number, int(row.soft_min),
                                                    int(row.soft_max), format.c_str(), logarithmic)
                                 : ImGui::DragInt("##value", &number, 0.2f, 0, 0, format.c_str());
        if (!changed) return false;
        if (row.odd && number % 2 == 0) ++number;
        if (!row.allowed.empty())
            number = int(*std::min_element(
                row.allowed.begin(), row.allowed.end(),
                [&](int64_t a, int64_t b) { return std::abs(a - number) < std::abs(b - number); }));
        value = int64_t(number);
        return true;
    }
    auto number = float(number_of(now));
    const std::string format = "%.4g" + unit;
    const bool changed =
        bounded ? ImGui::SliderFloat("##value", &number, float(row.soft_min), float(row.soft_max),
                                     format.c_str(), logarithmic)
                : ImGui::DragFloat("##value", &number, std::max(0.002f, std::abs(number) * 0.01f),
                                   0, 0, format.c_str());
    if (changed) value = shortest_double(number);
    return changed;
}

// True if the value was changed, to `value`. A row that is not set shows what it inherits, paler.
bool parameter_widget(const Parameter& row, const ParameterValue& set,
                      const std::optional<Inherited>& inherited, ParameterValue& value) {
    ParameterValue now = set;
    if (now == ParameterValue() && row.type != ParameterType::text) {
        if (!inherited || inherited->value.index() != first_value(row, {}).index()) {
            if (!ImGui::Button((words_of(row).unset + "##set").c_str(),
                               {ImGui::GetContentRegionAvail().x, 0}))
                return false;
            value = first_value(row, inherited);
            return true;
        }
        now = inherited->value;
    }
    switch (row.type) {
        case ParameterType::boolean: {
            bool on = std::get<bool>(now);
            if (!ImGui::Checkbox("##value", &on)) return false;
            value = on;
            return true;
        }
        case ParameterType::integer:
        case ParameterType::number:
            return number_widget(row, now, value);
        case ParameterType::choice: {
            const auto& chosen = std::get<std::string>(now);
            if (!ImGui::BeginCombo("##value", chosen.c_str())) return false;
            for (const std::string& choice : row.choices)
                if (ImGui::Selectable(choice.c_str(), choice == chosen)) value = choice;
            ImGui::EndCombo();
            return value != ParameterValue() && value != now;
        }
        case ParameterType::text: {
            const auto* written = std::get_if<std::string>(&now);
            std::string text = written ? *written : "";
            if (!ImGui::InputText("##value", &text, ImGuiInputTextFlags_EnterReturnsTrue))
                return false;
            value = text;
            return true;
        }
        case ParameterType::point: {
            const auto& at = std::get<std::array<double, 2>>(now);
            std::array<float, 2> point = {float(at[0]), float(at[1])};
            const TypesOnDoubleClick types;
            if (!ImGui::SliderFloat2("##value", point.data(), float(row.min), float(row.max),
                                     "%.3f"))
                return false;
            value = std::array<double, 2>{shortest_double(point[0]), shortest_double(point[1])};
            return true;
        }
    }
    return false;
}

}  // namespace

void ChainPanel::draw() {
    main_values();
    ImGui::Separator();
    link_list();
    ImGui::Separator();
    Document& document = ui_.session.document();
    const Chain& chain = document.chain();
    if (selected_ < chain.links.size()) {
        const size_t link = selected_;
        const PassType& type = *chain.links[link].type;
        ImGui::TextUnformatted(type.title.c_str());
        ui_.tip(concat(type.help, "\nkey: ", type.name));
        rows(
            *type.parameters, chain.links[link].pass->parameters(),
            [&, link](const Parameter& row) { return inherited(ui_.session, link, row); },
            [&, link](const std::string& key, const ParameterValue& value) {
                return document.set(link, key, value);
            });
    } else {
        ImGui::TextUnformatted("Camera of the chain");
        rows(
            camera_parameters(), &chain.camera,
            [&](const Parameter& row) { return inherited_by_camera(ui_.session, row); },
            [&](const std::string& key, const ParameterValue& value) {
                return document.set_camera(key, value);
            });
    }
}

void ChainPanel::camera_slider(const char* key, const char* label, double least, double most,
                               const char* format, bool logarithmic, std::optional<double> value) {
    auto number = float(value.value_or(least));
    ImGui::SetNextItemWidth(-72 * ui_.scale);
    std::optional<TypesOnDoubleClick> types(std::in_place);
    const bool changed =
        ImGui::SliderFloat(label, &number, float(least), float(most), value ? format : "not known",
                           logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
    types.reset();
    ui_.mark(key);
    ui_.gesture();
    ui_.tip(concat(camera_parameters().find(key)->help, "\nkey: camera.", key));
    if (const auto own = ui_.session.document().passes_with_own(key); !own.empty()) {
        std::string text;
        for (const std::string& name : own) text += (text.empty() ? "" : ", ") + name;
        ImGui::TextColored(kOverridden, "overridden in %s", text.c_str());
        ui_.mark(concat("overridden ", key));
        ui_.tip("a pass has a value of its own; a change here counts for all passes");
    }
    if (!changed) return;
    // With keys, the one of this frame changes.
    if (std::string_view(key) == "focus_distance" &&
        !ui_.session.document().state().focus_keys.empty())
        return ui_.say(ui_.session.document().set_focus_key(ui_.session.playback().frame(),
                                                            shortest_double(number)));
    ui_.say(ui_.session.document().set_camera(key, shortest_double(number)));
}

void ChainPanel::main_values() {
    const Camera camera = camera_of(ui_.session);
    const double shutter = shutter::open_frames({}, camera);
    char format[48];
    std::snprintf(format, sizeof(format), "%%.3f frames (%.0f deg)", shutter::kFrameDeg * shutter);
    camera_slider("shutter_frames", "shutter", 0, 1, format, false, shutter);
    camera_slider("f_stop", "f-stop", 0.7, 32, "f/%.2f", true, camera.f_stop);
    double nearest = 0.05, farthest = 1000;
    if (const SharedFrame source = ui_.session.source()) {
        const FrameBounds& bounds = source->description.bounds;
        if (std::isfinite(bounds.max_inverse_depth) && bounds.max_inverse_depth > 0)
            nearest = 0.5 / bounds.max_inverse_depth;
        if (bounds.min_inverse_depth > 1e-6) farthest = 2 / bounds.min_inverse_depth;
    }
    camera_slider("focus_distance", "focus", nearest, std::max(farthest, nearest * 2), "%.3f units",
                  true, camera.focus_distance);
    int samples = 0, most = 256;
    for (const ChainLink& link : ui_.session.document().chain().links) {
        const Parameter* row = link.type->parameters->find("samples");
        if (!row || !link.type->parameters->unread(*row, link.pass->parameters()).empty()) continue;
        samples = int(number_of(row->get(link.pass->parameters())));
        most = std::isfinite(row->soft_max) ? int(row->soft_max) : most;
        break;
    }
    ImGui::BeginDisabled(samples == 0);
    ImGui::SetNextItemWidth(-72 * ui_.scale);
    std::optional<TypesOnDoubleClick> types(std::in_place);
    const bool changed = ImGui::SliderInt("samples", &samples, 1, std::max(most, samples),
                                          "%d per pixel", ImGuiSliderFlags_Logarithmic);
    types.reset();
    ui_.mark("samples");
    ui_.gesture();
    ImGui::EndDisabled();
    if (changed) {
        Status status = ui_.session.document().set_in_all("samples", int64_t(samples));
        // Some passes take odd numbers only.
        if (!status.ok())
            status = ui_.session.document().set_in_all("samples", int64_t(samples | 1));
        ui_.say(status);
    }
    order_and_tier();
}

void ChainPanel::order_and_tier() {
    Document& document = ui_.session.document();
    std::vector<size_t> now(document.chain().links.size());
    std::iota(now.begin(), now.end(), size_t(0));
    ImGui::SetNextItemWidth(-72 * ui_.scale);
    const bool orders = ImGui::BeginCombo("order", document.name_of_order(now).c_str());
    ui_.mark("order");
    if (orders) {
        const auto list = document.orders();
        if (list.empty())
            ImGui::TextDisabled(now.empty() ? "no pass yet" : "drag the passes below");
        for (const auto& order : list) {
            const std::string name = document.name_of_order(order);
            const bool chosen = ImGui::Selectable(name.c_str());
            ui_.mark("order " + name);
            if (!chosen) continue;
            ui_.say(document.reorder(order));
            break;
        }
        ImGui::EndCombo();
    }
    ImGui::SetNextItemWidth(-72 * ui_.scale);
    const bool tiers = ImGui::BeginCombo("quality", "passes of ...");
    ui_.mark("quality");
    if (tiers) {
        for (const std::string& name : shipped_chains()) {
            if (ImGui::Selectable(name.c_str())) {
                const auto shipped = load_chain(name, document.registry());
                if (shipped.ok())
                    document.take_passes(shipped->chain, name);
                else
                    ui_.say(shipped.status());
            }
            ui_.mark("quality " + name);
        }
        ImGui::EndCombo();
    }
}

void ChainPanel::link_list() {
    Document& document = ui_.session.document();
    for (size_t i = 0; i < document.chain().links.size(); ++i) {
        ImGui::PushID(int(i));
        const std::string name = document.chain().links[i].type->name;
        bool on = !document.state().off[i];
        if (ImGui::Checkbox("##on", &on)) ui_.say(document.switch_off(i, !on));
        ui_.mark(concat("on ", i));
        ui_.tip("switch the pass on or off");
        ImGui::SameLine();
        if (ImGui::Selectable(name.c_str(), selected_ == i, 0,
                              {ImGui::GetContentRegionAvail().x - 30 * ui_.scale, 0}))
            selected_ = i;
        ui_.mark(concat("pass ", i));
        const float top = ImGui::GetItemRectMin().y, bottom = ImGui::GetItemRectMax().y;
        if (ImGui::IsItemActivated()) {
            drag_link_ = int(i);
            document.begin_gesture();
        }
        if (drag_link_ < 0) ui_.tip("click: its parameters; drag: another place in the chain");
        const bool held = drag_link_ >= 0 && ImGui::IsMouseDown(ImGuiMouseButton_Left);
        const float mouse = ImGui::GetIO().MousePos.y;
        ImGui::SameLine();
        const bool removes = ImGui::SmallButton("x");
        ui_.mark(concat("remove ", i));
        ui_.tip("remove the pass");
        ImGui::PopID();
        if (removes) {
            ui_.say(document.erase(i));
            break;
        }
        if (held && int(i) != drag_link_ && mouse > top && mouse < bottom) {
            ui_.say(document.move(size_t(drag_link_), i));
            drag_link_ = int(i);
            selected_ = i;
            break;
        }
    }
    if (drag_link_ >= 0 && !ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
        drag_link_ = -1;
        document.end_gesture();
    }
    if (ImGui::Selectable("camera", selected_ >= document.chain().links.size()))
        selected_ = document.chain().links.size();
    ui_.mark("camera");
    ImGui::SetNextItemWidth(-1);
    const bool adds = ImGui::BeginCombo("##add", "add a pass");
    ui_.mark("add");
    if (adds) {
        for (const PassType& type : document.registry().types()) {
            if (ImGui::Selectable(type.name.c_str()))
                ui_.say(document.add(type.name, document.chain().links.size()));
            ui_.mark("add " + type.name);
            ui_.tip(type.help);
        }
        ImGui::EndCombo();
    }
}

void ChainPanel::rows(const ParameterTable& table, ConstParameterRef values,
                      const Inherits& inherits,
                      const std::function<Status(const std::string&, const ParameterValue&)>& set) {
    std::optional<std::pair<std::string, ParameterValue>> change;
    for (const ParameterGroup& group : parameter_groups()) {
        std::vector<const Parameter*> members;
        bool any_set = false;
        for (const Parameter& row : table.rows()) {
            if (words_of(row).group != group.name) continue;
            members.push_back(&row);
            any_set = any_set || row.get(values) != row.default_value;
        }
        if (members.empty()) continue;
        ImGui::SetNextItemOpen(group.open || any_set, ImGuiCond_Once);
        const bool open = ImGui::CollapsingHeader(group.name.c_str());
        ui_.mark("group " + group.name);
        if (!open || !ImGui::BeginTable(group.name.c_str(), 3, ImGuiTableFlags_SizingFixedFit))
            continue;
        ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthStretch, 0.45f);
        ImGui::TableSetupColumn("value", ImGuiTableColumnFlags_WidthStretch, 0.55f);
        ImGui::TableSetupColumn("reset", ImGuiTableColumnFlags_WidthFixed, 22 * ui_.scale);
        for (const Parameter* row : members)
            if (const auto value = draw_row(*row, table, values, inherits))
                change = {row->key, *value};
        ImGui::EndTable();
    }
    if (change) ui_.say(set(change->first, change->second));
}

std::optional<ParameterValue> ChainPanel::draw_row(const Parameter& row,
                                                   const ParameterTable& table,
                                                   ConstParameterRef values,
                                                   const Inherits& inherits) {
    std::optional<ParameterValue> change;
    ImGui::PushID(row.key.c_str());
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    const std::string unread = table.unread(row, values);
    const ParameterValue now = row.get(values);
    const std::optional<Inherited> from = now == ParameterValue() ? inherits(row) : std::nullopt;
    const bool pale = !unread.empty() || now == ParameterValue();
    const ImVec2 cell = ImGui::GetCursorScreenPos();
    const bool hovers = ImGui::IsWindowHovered() &&
                        ImGui::IsMouseHoveringRect(cell, {cell.x + ImGui::GetContentRegionAvail().x,
                                                          cell.y + ImGui::GetFrameHeight()});
    ImGui::AlignTextToFramePadding();
    ImGui::PushTextWrapPos(0);
    ImGui::TextColored(ImGui::GetStyle().Colors[pale ? ImGuiCol_TextDisabled : ImGuiCol_Text], "%s",
                       words_of(row).label.c_str());
    ImGui::PopTextWrapPos();
    ImGui::TableNextColumn();
    ParameterValue value;
    ImGui::SetNextItemWidth(-1);
    ImGui::BeginDisabled(!unread.empty());
    if (from) ImGui::PushStyleVar(ImGuiStyleVar_Alpha, ImGui::GetStyle().Alpha * kInheritedAlpha);
    if (parameter_widget(row, now, from, value)) change = value;
    if (from) ImGui::PopStyleVar();
    ui_.mark("row " + row.key);
    ui_.gesture();
    ImGui::EndDisabled();
    if (hovers || ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) {
        ImGui::BeginTooltip();
        ImGui::PushTextWrapPos(380 * ui_.scale);
        ImGui::TextUnformatted(row.full_help().c_str());
        ImGui::TextDisabled("key: %s", row.key.c_str());
        ImGui::TextDisabled("%s%s; default %s", row.domain().c_str(),
                            row.unit.empty() ? "" : (", " + row.unit).c_str(),
                            now == ParameterValue() && !row.unset_means.empty()
                                ? as_keys(row.unset_means).c_str()
                                : text_of(row.default_value).c_str());
        if (from) ImGui::TextUnformatted(("not set: taken from " + from->from).c_str());
        if (!unread.empty()) ImGui::TextUnformatted(unread.c_str());
        ImGui::PopTextWrapPos();
        ImGui::EndTooltip();
    }
    ImGui::TableNextColumn();
    if (now != row.default_value) {
        if (ImGui::SmallButton("<")) change = row.default_value;
        ui_.mark("reset " + row.key);
        ui_.tip("back to " + (row.optional ? "what it inherits" : text_of(row.default_value)));
    }
    ImGui::PopID();
    return change;
}

}  // namespace postchain::view
