// The window's contents, drawn with Dear ImGui. The logic is in Session; here are only the widgets.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/apps/view/chain_panel.h"
#include "tools/apps/view/file_dialog.h"
#include "tools/apps/view/inspect_panel.h"
#include "tools/apps/view/keys.h"
#include "tools/apps/view/picture_panel.h"
#include "tools/apps/view/save_panel.h"
#include "tools/apps/view/timeline.h"
#include "tools/apps/view/ui_context.h"

namespace postchain::view {

class Ui {
  public:
    Ui(Session& session, std::function<void()> wake);

    // One ImGui frame over the whole window.
    void draw(float width, float height, float scale);
    bool upload() { return picture_.upload(); }
    void add_interface_ms(double ms) { inspect_.add_interface_ms(ms); }

    bool wants_to_close() const { return close_; }
    // At once, or after a question if edits are not saved.
    void ask_to_close();
    bool is_asking() const { return asking_; }
    bool wants_full_screen() const { return full_screen_; }

    // Opens files in place of those that are open; another chain after a question if edits are not
    // saved.
    void open(const OpenRequest& request);
    // The files to open now; a second call has none.
    std::optional<OpenRequest> take_request();

    UiContext& context() { return ui_; }
    const UiContext& context() const { return ui_; }
    const ViewPort& port() const { return picture_.port(); }
    const Exporter& exporter() const { return save_.exporter(); }
    const std::deque<double>& interface_ms() const { return inspect_.interface_ms(); }
    const std::vector<KeyAction>& keys() const { return keys_; }

  private:
    std::vector<KeyAction> key_actions();
    void ask_for(FileKind kind);
    void take_input();
    void set_range_end(size_t end);
    void draw_side(float x, float y, float width, float height);
    void draw_open_menu();
    void draw_bottom(float x, float y, float width, float height);
    void draw_messages(float x, float y, float width);
    void draw_question(float width, float height);
    bool has_unsaved_edits() const;

    UiContext ui_;
    FileDialog dialog_;
    PicturePanel picture_;
    ChainPanel chain_;
    InspectPanel inspect_;
    SavePanel save_;
    Timeline timeline_;
    std::vector<KeyAction> keys_;
    bool close_ = false, asking_ = false, full_screen_ = false;
    bool panels_ = true, key_list_ = false;
    OpenRequest asked_, accepted_;  // before and after the question
};

}  // namespace postchain::view
