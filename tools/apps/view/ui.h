// The window's contents, drawn with Dear ImGui. The logic is in Session; here are only the widgets.
#pragma once

#include <functional>

#include "tools/apps/view/chain_panel.h"
#include "tools/apps/view/inspect_panel.h"
#include "tools/apps/view/picture_panel.h"
#include "tools/apps/view/save_panel.h"
#include "tools/apps/view/ui_context.h"

namespace postchain::view {

class Ui {
  public:
    Ui(Session& session, std::function<void()> wake)
        : ui_{session}, picture_(ui_), chain_(ui_), inspect_(ui_), save_(ui_, std::move(wake)) {}

    // One ImGui frame over the whole window.
    void draw(float width, float height, float scale);
    bool upload() { return picture_.upload(); }
    void add_interface_ms(double ms) { inspect_.add_interface_ms(ms); }

    bool wants_to_close() const { return close_; }
    // At once, or after a question if edits are not saved.
    void ask_to_close();
    bool is_asking() const { return closing_; }

    const UiContext& context() const { return ui_; }
    const ViewPort& port() const { return picture_.port(); }
    const Exporter& exporter() const { return save_.exporter(); }
    const std::deque<double>& interface_ms() const { return inspect_.interface_ms(); }

  private:
    void shortcuts();
    void draw_side(float x, float y, float width, float height);
    void draw_bottom(float x, float y, float width, float height);
    void draw_messages(float x, float y, float width);
    void draw_closing(float width, float height);

    UiContext ui_;
    PicturePanel picture_;
    ChainPanel chain_;
    InspectPanel inspect_;
    SavePanel save_;
    bool close_ = false, closing_ = false;
};

}  // namespace postchain::view
