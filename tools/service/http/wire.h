// Converts bytes to a Request, and a Reply to bytes.
#pragma once

#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstdint>
#include <string>

#include "tools/service/http/message.h"

namespace postchain::service {

using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;

// The request without its body, from the header that the parser has read.
Request request_of(const Parser& parser);
// The refusal of a request that the parser could not read; nothing if the client has left.
std::optional<Reply> refusal_of(const boost::system::error_code& error, uint64_t max_body);

// Status line and headers. `keep`: the connection stays open.
std::string head_of(const Reply& reply, bool keep);

}  // namespace postchain::service
