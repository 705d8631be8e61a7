// The viewer's messages to its user.
#pragma once

#include <deque>
#include <string>

namespace postchain::view {

struct Message {
    bool error = false;
    std::string text;
};

// The newest last, each text once.
class Messages {
  public:
    // Messages of shared code get the window's words.
    void say(const std::string& words, bool error = false);
    void clear() { list_.clear(); }
    const std::deque<Message>& list() const { return list_; }

  private:
    std::deque<Message> list_;
};

// A message of the code that the command shares, with the remedies that the window has: the box
// "replace existing files" in place of --on-existing, and no option of `run`.
std::string in_words_of_window(std::string message);

}  // namespace postchain::view
