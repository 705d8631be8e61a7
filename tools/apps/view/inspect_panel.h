// The view, the tools of the mouse, times, memory and the plan.
#pragma once

#include <deque>
#include <map>
#include <string>

#include "tools/apps/view/ui_context.h"

namespace postchain::view {

class InspectPanel {
  public:
    explicit InspectPanel(UiContext& ui) : ui_(ui) {}
    void draw();
    // Adds the times of a new result to the history.
    void note_times();
    void add_interface_ms(double ms);
    const std::deque<double>& interface_ms() const { return interface_ms_; }

  private:
    void draw_view();
    void draw_times();
    void draw_plan();

    UiContext& ui_;
    // Times of refined frames, ms: the filter, and each step by name.
    std::deque<float> history_;
    std::map<std::string, std::deque<float>> step_history_;
    uint64_t in_history_ = 0;  // the last request
    int first_ = 3;
    std::deque<double> interface_ms_;
    double slowest_ms_ = 0;
};

}  // namespace postchain::view
