#include "tools/apps/view/messages.h"

#include <regex>
#include <utility>
#include <vector>

#include "chain/base/setting_text.h"

namespace postchain::view {
namespace {

constexpr size_t kMessages = 50;

}  // namespace

void Messages::say(const std::string& words, bool error) {
    const std::string text = in_words_of_window(words);
    std::erase_if(list_, [&](const Message& message) { return message.text == text; });
    list_.push_back({error, text});
    if (list_.size() > kMessages) list_.pop_front();
}

std::string in_words_of_window(std::string message) {
    static const std::vector<std::pair<std::regex, std::string>> words = {
        {std::regex("choose --on-existing [a-z ]+, or "), "check \"replace existing files\", or "},
        {std::regex("go without it \\(--no-sidecar\\), or "), ""},
        {std::regex("name another (output|folder) with --[a-z-]+"), "name another $1"},
    };
    message = as_options(message);
    for (const auto& [command, window] : words)
        message = std::regex_replace(message, command, window);
    return message;
}

}  // namespace postchain::view
