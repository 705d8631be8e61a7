// Settings in messages and help. A library names them by key, in marks; each front end shows the
// text with the names that its users know, and never as it is:
//
//   "{on_existing=skip}"_keyed   as_options(): --on-existing skip   as_keys(): on_existing: skip
//   "{mkdir=true}"_keyed                       --mkdir                         mkdir: true
//   "without {png}"_keyed                      without --png                   without png
#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace postchain {

// The braces become marks that no other text has: two of Unicode's noncharacters.
std::string operator""_keyed(const char* text, size_t size);
std::string setting(const std::string& key, const std::string& value = {});  // "{key=value}"_keyed

std::string option_name(const std::string& key);  // "on_existing" -> "--on-existing"
std::string as_options(std::string_view text);    // for a command line
std::string as_keys(std::string_view text);       // for JSON and YAML
using NameSetting = std::string (*)(const std::string& key, const std::string& value);
std::string with_settings(std::string_view text, NameSetting name);

// "{frames}: no frame 7" -> "frames", "no frame 7". The key is empty if none begins the message.
std::pair<std::string, std::string> split_key(const std::string& message);

}  // namespace postchain
