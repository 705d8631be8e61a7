// The pages that browsers show, put together when the program is built (bundle.cmake), and the data
// that is written into them.
//
//   page.html of this folder + JSON --> one HTML file that opens from disk and needs no network
#pragma once

#include <string>
#include <string_view>

namespace postchain::page {

// "report/page.html", "service/main.js": the text of a file; empty: no such file.
std::string_view file(std::string_view path);

// A page up to the place of its data, and the rest.
struct Halves {
    std::string_view before, after;
};
Halves halves_of(std::string_view path);

// A script element with the id that holds the JSON. In JSON "<" occurs in strings only: it is
// escaped there, so that no name of a file ends the element.
std::string data_element(std::string_view id, std::string_view json);

// The page with its data as the element "data".
std::string with_data(std::string_view path, std::string_view json);

}  // namespace postchain::page
