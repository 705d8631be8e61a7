// The chain: the values that matter first, its passes, and every parameter of one.
#pragma once

#include <functional>
#include <optional>

#include "tools/apps/view/session_values.h"
#include "tools/apps/view/ui_context.h"

namespace postchain::view {

class ChainPanel {
  public:
    explicit ChainPanel(UiContext& ui) : ui_(ui) {}
    void draw();

  private:
    void main_values();
    void camera_slider(const char* key, const char* label, double least, double most,
                       const char* format, bool logarithmic, std::optional<double> value);
    void order_and_tier();
    void link_list();
    using Inherits = std::function<std::optional<Inherited>(const Parameter&)>;
    // A row's new value; empty: it stays.
    std::optional<ParameterValue> draw_row(const Parameter& row, const ParameterTable& table,
                                           ConstParameterRef values, const Inherits& inherits);
    void rows(const ParameterTable& table, ConstParameterRef values, const Inherits& inherits,
              const std::function<Status(const std::string&, const ParameterValue&)>& set);

    UiContext& ui_;
    size_t selected_ = 0;
    int drag_link_ = -1;
};

}  // namespace postchain::view
