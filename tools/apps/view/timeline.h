// The frames of the sequence as a bar: the one that is shown, those that are missing, the range of
// play, the frames whose filtered images are kept, the focus keys.
#pragma once

#include "tools/apps/view/ui_context.h"

namespace postchain::view {

class Timeline {
  public:
    explicit Timeline(UiContext& ui) : ui_(ui) {}
    void draw(float width);

  private:
    UiContext& ui_;
};

}  // namespace postchain::view
