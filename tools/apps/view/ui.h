// The window's contents, drawn with Dear ImGui. All logic is in Session; here are only the widgets.
#pragma once

#include <imgui.h>

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "tools/apps/view/export.h"
#include "tools/apps/view/screen_texture.h"
#include "tools/apps/view/session.h"
#include "tools/apps/view/view_port.h"

namespace postchain::view {

class Ui {
  public:
    Ui(Session& session, std::function<void()> wake);

    // One ImGui frame over the whole window.
    void draw(float width, float height, float scale);
    // Textures are uploaded in parts; true while one is left.
    bool upload();

    void add_interface_ms(double ms);
    const std::deque<double>& interface_ms() const { return interface_ms_; }
    double slowest_interface_ms() const { return slowest_ms_; }
    // Rectangles of widgets by name: x, y, width, height, pixels of the window.
    const std::map<std::string, std::array<float, 4>>& places() const { return places_; }
    const ViewPort& port() const { return port_; }
    const Exporter& exporter() const { return exporter_; }
    bool wants_to_close() const { return close_; }
    void ask_to_close();

  private:
    void shortcuts();
    void draw_picture(float x, float y, float width, float height);
    void draw_image(ImDrawList& list, const ScreenTexture& texture, float from, float to);
    void draw_overlays(ImDrawList& list);
    void pointer(float x, float y);
    void draw_bottom(float x, float y, float width, float height);
    void draw_side(float x, float y, float width, float height);
    void draw_messages(float x, float y, float width);
    void draw_closing(float width, float height);

    void chain_tab();
    void main_values();
    void camera_slider(const char* key, const char* label, double least, double most,
                       const char* format, bool logarithmic, std::optional<double> value);
    void order_and_tier();
    void link_list();
    void rows(const ParameterTable& table, ConstParameterRef values,
              const std::function<Status(const std::string&, const ParameterValue&)>& set);
    void compare_tab();
    void inspect_tab();
    void plan_view();
    void times_view();
    void save_tab();
    void save_button(const char* name, const char* label, std::string& path, const char* hint,
                     const std::function<void(const std::string&)>& save);
    void start_export(ExportKind kind, const std::string& path);

    void mark(const std::string& name);  // the last widget
    void say(const Status& status);
    // The edits while the last widget is held are one step of undo.
    void gesture();

    Session& session_;
    Exporter exporter_;
    float scale_ = 1;
    ViewPort port_;
    ImVec2 picture_at_ = {0, 0}, picture_size_ = {1, 1};
    ScreenTexture image_, other_, map_, limits_;
    uint64_t uploaded_ = 0;
    double wipe_ = 0.5;
    bool flipped_ = false, dragging_wipe_ = false;
    std::optional<std::array<int, 2>> cursor_, pressed_;
    bool focus_tool_ = false, path_ = false;
    size_t selected_ = 0;
    int drag_link_ = -1;
    std::string chain_path_, camera_path_, frames_path_, png_path_, sheet_path_, movie_path_;
    bool replace_ = false, close_ = false, closing_ = false;
    std::deque<float> history_;  // ms of filtered frames
    double last_ms_ = 0;
    std::deque<double> interface_ms_;
    double slowest_ms_ = 0;
    std::map<std::string, std::array<float, 4>> places_;
};

// A widget for a parameter: true if it was changed, to `value`.
bool parameter_widget(const Parameter& row, const ParameterValue& now, ParameterValue& value);

}  // namespace postchain::view
