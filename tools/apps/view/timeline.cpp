#include "tools/apps/view/timeline.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace postchain::view {
namespace {

const ImU32 kBar = IM_COL32(52, 54, 58, 255), kOutside = IM_COL32(30, 31, 33, 255);
const ImU32 kMissing = IM_COL32(120, 62, 58, 255), kKept = IM_COL32(96, 160, 110, 255);
const ImU32 kHere = IM_COL32(235, 235, 235, 255), kFocus = IM_COL32(242, 200, 115, 255);

}  // namespace

void Timeline::draw(float width) {
    const Session& session = ui_.session;
    Playback& playback = ui_.session.playback();
    const std::vector<int> list = playback.frames();
    if (list.empty()) return ImGui::TextDisabled("no frame yet");
    const float height = ImGui::GetFrameHeight();
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::InvisibleButton("frames", {std::max(width, 20.0f), height});
    ui_.mark("frame");
    width = ImGui::GetItemRectSize().x;
    const int first = list.front();
    const double count = double(list.back()) - first + 1;
    const auto left_of = [&](double frame) {
        return at.x + float((frame - first) / count * double(width));
    };
    const auto under = [&](float x) {
        return first + int(std::clamp(std::floor(double(x - at.x) / double(width) * count), 0.0,
                                      count - 1));
    };
    ImDrawList& paint = *ImGui::GetWindowDrawList();
    const auto cells = [&](int from, int to, float top, float bottom, ImU32 color) {
        paint.AddRectFilled({left_of(from), top},
                            {std::max(left_of(to + 1.0), left_of(from) + 1), bottom}, color);
    };
    const float bottom = at.y + height;
    const int range_from = playback.range() ? (*playback.range())[0] : first;
    const int range_to = playback.range() ? (*playback.range())[1] : list.back();
    paint.AddRectFilled(at, {at.x + width, bottom}, kOutside, 3);
    cells(std::max(range_from, first), std::min(range_to, list.back()), at.y, bottom, kBar);
    const auto missing = playback.missing_frames();
    for (const int frame : missing) cells(frame, frame, at.y, bottom, kMissing);
    for (const int frame : session.frames_with_result())
        cells(frame, frame, bottom - 3 * ui_.scale, bottom, kKept);
    for (const auto& [frame, distance] : session.document().state().focus_keys) {
        const float x = left_of(frame + 0.5), y = at.y + 5 * ui_.scale, r = 4 * ui_.scale;
        paint.AddQuadFilled({x, y - r}, {x + r, y}, {x, y + r}, {x - r, y}, kFocus);
    }
    const float here = left_of(playback.frame() + 0.5);
    cells(playback.frame(), playback.frame(), at.y, bottom, IM_COL32(255, 255, 255, 40));
    paint.AddLine({here, at.y}, {here, bottom}, kHere, std::max(1.0f, ui_.scale));
    const std::string label = concat(playback.frame());
    const ImVec2 size = ImGui::CalcTextSize(label.c_str());
    const bool flips = here + size.x + 8 * ui_.scale > at.x + width;
    paint.AddText({flips ? here - size.x - 4 * ui_.scale : here + 4 * ui_.scale,
                   at.y + (height - size.y) / 2},
                  kHere, label.c_str());
    if (ImGui::IsItemActive()) return playback.go_to(under(ImGui::GetIO().MousePos.x));
    if (!ImGui::IsItemHovered()) return;
    const int frame = under(ImGui::GetIO().MousePos.x);
    std::string text = concat("frame ", frame);
    if (std::binary_search(missing.begin(), missing.end(), frame)) text += ": not on disk";
    const auto& keys = session.document().state().focus_keys;
    if (const auto key = keys.find(frame); key != keys.end())
        text += concat("\nfocus key: ", key->second);
    if (session.frames_with_result().contains(frame)) text += "\nfiltered image kept";
    ImGui::SetTooltip("%s", text.c_str());
}

}  // namespace postchain::view
