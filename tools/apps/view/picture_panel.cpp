#include "tools/apps/view/picture_panel.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/apps/view/session_values.h"

namespace postchain::view {
namespace {

constexpr int kBytesAtOnce = 8 << 20;  // of an upload
constexpr float kDragFrom = 6;         // pixels: a shorter drag is a click
constexpr float kGrabWipe = 8;         // pixels around its line
constexpr double kNearestFrom = 2;     // zoom from which pixels are shown as squares

const ImU32 kWhite = IM_COL32(255, 255, 255, 255), kBlack = IM_COL32(0, 0, 0, 200);
const ImU32 kPath = IM_COL32(255, 230, 60, 255);

// Text that is readable over any image.
void label(ImDrawList& list, ImVec2 at, const std::string& text) {
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    list.AddRectFilled({at.x - 4, at.y - 2}, {at.x + size.x + 4, at.y + size.y + 2}, kBlack, 3);
    list.AddText(at, kWhite, text.c_str());
}

}  // namespace

ScreenTexture::~ScreenTexture() {
    for (const unsigned name : {shown_.name, next_.name})
        if (name) glDeleteTextures(1, &name);
}

void ScreenTexture::set(std::shared_ptr<const Rgba> image) {
    if (image == image_) return;
    image_ = std::move(image);
    row_ = 0;
    if (image_) return;
    if (shown_.name) glDeleteTextures(1, &shown_.name);
    shown_ = {};
}

bool ScreenTexture::upload() {
    if (!image_ || row_ >= image_->height) return false;
    if (row_ == 0) {
        if (!next_.name) {
            glGenTextures(1, &next_.name);
            glBindTexture(GL_TEXTURE_2D, next_.name);
            glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
            glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        }
        glBindTexture(GL_TEXTURE_2D, next_.name);
        if (next_.width != image_->width || next_.height != image_->height)
            glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, image_->width, image_->height, 0, GL_RGBA,
                         GL_UNSIGNED_BYTE, nullptr);
        next_.width = image_->width;
        next_.height = image_->height;
    }
    const int rows = std::clamp(kBytesAtOnce / (4 * image_->width), 1, image_->height - row_);
    glBindTexture(GL_TEXTURE_2D, next_.name);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, row_, image_->width, rows, GL_RGBA, GL_UNSIGNED_BYTE,
                    image_->pixel(0, row_));
    row_ += rows;
    if (row_ < image_->height) return true;
    std::swap(shown_, next_);
    return false;
}

void ScreenTexture::set_filter(bool nearest) const {
    glBindTexture(GL_TEXTURE_2D, shown_.name);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, nearest ? GL_NEAREST : GL_LINEAR);
}

bool PicturePanel::upload() {
    const Painted& painted = ui_.session.painted();
    if (uploaded_ != ui_.session.painted_revision()) {
        uploaded_ = ui_.session.painted_revision();
        image_.set(painted.image);
        other_.set(painted.other);
        map_.set(painted.map);
        limits_.set(painted.limits);
    }
    for (ScreenTexture* texture : {&image_, &other_, &map_, &limits_})
        if (texture->upload()) return true;
    return false;
}

// The part of a texture between two fractions of the picture's width on screen.
void PicturePanel::draw_image(ImDrawList& list, const ScreenTexture& texture, float from,
                              float to) {
    if (!texture.name() || to <= from) return;
    texture.set_filter(port_.zoom() >= kNearestFrom);
    const SharedFrame source = ui_.session.source();
    const int width = source ? source->description.width : texture.width();
    const int height = source ? source->description.height : texture.height();
    // On whole pixels of the screen, so that 1:1 shows the image's own values.
    const Point exact = port_.to_screen({0, 0}),
                end = port_.to_screen({double(width), double(height)});
    const Point a = {std::round(exact[0]), std::round(exact[1])};
    const Point b = {a[0] + end[0] - exact[0], a[1] + end[1] - exact[1]};
    list.PushClipRect({picture_at_.x + from * picture_size_.x, picture_at_.y},
                      {picture_at_.x + to * picture_size_.x, picture_at_.y + picture_size_.y},
                      true);
    list.AddImage(ImTextureID(intptr_t(texture.name())),
                  {picture_at_.x + float(a[0]), picture_at_.y + float(a[1])},
                  {picture_at_.x + float(b[0]), picture_at_.y + float(b[1])});
    list.PopClipRect();
}

void PicturePanel::draw(float x, float y, float width, float height) {
    picture_at_ = {x, y};
    picture_size_ = {std::max(width, 1.0f), std::max(height, 1.0f)};
    if (const SharedFrame source = ui_.session.source())
        port_.set(source->description.width, source->description.height,
                  source->description.pixel_aspect, {picture_size_.x, picture_size_.y});
    ui_.session.view().visible = port_.visible();
    ImGui::SetNextWindowPos(picture_at_);
    ImGui::SetNextWindowSize(picture_size_);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
    ImGui::Begin("picture", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBackground |
                     ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::InvisibleButton("area", picture_size_,
                           ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonMiddle |
                               ImGuiButtonFlags_MouseButtonRight);
    ui_.mark("picture");
    pointer(x, y);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.PushClipRect(picture_at_,
                      {picture_at_.x + picture_size_.x, picture_at_.y + picture_size_.y}, true);
    const ViewChoice& view = ui_.session.view();
    const bool compares = view.compare != Compare::off && view.plane == "result" && other_.name();
    if (compares && view.compare == Compare::wipe) {
        draw_image(list, image_, 0, float(wipe_));
        draw_image(list, other_, float(wipe_), 1);
        const float line = picture_at_.x + float(wipe_) * picture_size_.x;
        list.AddLine({line, picture_at_.y}, {line, picture_at_.y + picture_size_.y}, kWhite,
                     std::max(1.0f, ui_.scale));
        const float top = picture_at_.y + picture_size_.y / 2;
        const char* other = view.target == CompareTarget::before        ? "before the chain"
                            : view.target == CompareTarget::other_chain ? "chain B"
                                                                        : "ground truth";
        label(list, {line - ImGui::CalcTextSize("result").x - 10 * ui_.scale, top}, "result");
        label(list, {line + 10 * ui_.scale, top}, other);
    } else if (compares && view.compare == Compare::difference && map_.name()) {
        draw_image(list, map_, 0, 1);
    } else {
        draw_image(list, compares && view.compare == Compare::flip && ui_.flipped ? other_ : image_,
                   0, 1);
    }
    if (view.limits) draw_image(list, limits_, 0, 1);
    draw_overlays(list);
    list.PopClipRect();
    ImGui::End();
    ImGui::PopStyleVar();
}

void PicturePanel::pointer(float x, float y) {
    const ImGuiIO& io = ImGui::GetIO();
    cursor_.reset();
    if (!ImGui::IsItemHovered() && !ImGui::IsItemActive()) return;
    const Point at = {io.MousePos.x - x, io.MousePos.y - y};
    const Point in_image = port_.to_image(at);
    const std::array<int, 2> pixel = {int(std::floor(in_image[0])), int(std::floor(in_image[1]))};
    const SharedFrame source = ui_.session.source();
    const bool inside = source && pixel[0] >= 0 && pixel[1] >= 0 &&
                        pixel[0] < source->description.width &&
                        pixel[1] < source->description.height;
    if (inside) cursor_ = pixel;
    if (io.MouseWheel != 0) port_.zoom_at(at, std::pow(1.2, double(io.MouseWheel)));

    const float line = float(wipe_) * picture_size_.x;
    const bool at_wipe = ui_.session.view().compare == Compare::wipe &&
                         std::abs(float(at[0]) - line) < kGrabWipe * ui_.scale;
    if (ImGui::IsItemClicked(ImGuiMouseButton_Left)) {
        dragging_wipe_ = at_wipe;
        pressed_ = inside && ui_.focus_tool && !at_wipe ? cursor_ : std::nullopt;
    }
    if (ImGui::IsItemActive() && dragging_wipe_ && io.MouseDown[0])
        wipe_ = std::clamp(at[0] / picture_size_.x, 0.0, 1.0);
    else if (ImGui::IsItemActive() && !pressed_ && (io.MouseDelta.x != 0 || io.MouseDelta.y != 0))
        port_.pan(io.MouseDelta.x, io.MouseDelta.y);
    if (pressed_ && ImGui::IsMouseReleased(ImGuiMouseButton_Left)) {
        const ImVec2 drag = ImGui::GetMouseDragDelta(ImGuiMouseButton_Left, 0);
        const bool pulls = std::hypot(drag.x, drag.y) > kDragFrom * ui_.scale;
        if (pulls && cursor_)
            ui_.say(focus_pull(ui_.session, *pressed_, *cursor_));
        else if (!pulls)
            ui_.say(focus_at_pixel(ui_.session, (*pressed_)[0], (*pressed_)[1]));
        pressed_.reset();
    }
    if (!ImGui::IsAnyMouseDown()) dragging_wipe_ = false;
}

void PicturePanel::draw_overlays(ImDrawList& list) {
    const auto on_screen = [&](const Point& point) {
        const Point at = port_.to_screen(point);
        return ImVec2(picture_at_.x + float(at[0]), picture_at_.y + float(at[1]));
    };
    if (ui_.path && cursor_) {
        const auto path = motion_path(ui_.session, (*cursor_)[0], (*cursor_)[1]);
        for (size_t i = 1; i < path.size(); ++i)
            list.AddLine(on_screen(path[i - 1]), on_screen(path[i]), kPath, 2 * ui_.scale);
        if (!path.empty()) {
            list.AddCircleFilled(on_screen(path.front()), 3 * ui_.scale, kBlack);
            list.AddCircleFilled(on_screen(path.back()), 4 * ui_.scale, kPath);
        }
    }
    const float line_height = ImGui::GetTextLineHeight() + 6;
    ImVec2 corner = {picture_at_.x + 12 * ui_.scale,
                     picture_at_.y + picture_size_.y - line_height - 6 * ui_.scale};
    if (ui_.focus_tool) {
        std::string text = "focus: click a surface; drag from one to another for a pull";
        if (pressed_ && cursor_)
            list.AddLine(on_screen({(*pressed_)[0] + 0.5, (*pressed_)[1] + 0.5}),
                         on_screen({(*cursor_)[0] + 0.5, (*cursor_)[1] + 0.5}), kWhite, ui_.scale);
        if (cursor_)
            if (const auto distance = distance_at(ui_.session, (*cursor_)[0], (*cursor_)[1]))
                text += concat("   ", *distance);
        label(list, corner, text);
        corner.y -= line_height;
    }
    if (ui_.session.view().limits) {
        const auto limits = sharp_limits(ui_.session);
        label(list, corner,
              limits ? concat("sharp from ", (*limits)[0], " (orange) to ",
                              std::isfinite((*limits)[1]) ? concat((*limits)[1]) : "infinity",
                              " (cyan)")
                     : std::string("no pass of this chain has a lens"));
    }
}

}  // namespace postchain::view
