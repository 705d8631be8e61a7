// From bytes to a Request, and from a Reply to bytes.
#pragma once

#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstdint>
#include <string>

#include "tools/service/http/message.h"

namespace postchain::service {

using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;

// The request whose header the parser has read; without its body.
Request request_of(const Parser& parser);
// The refusal of what the parser could not read; none where the client is gone.
std::optional<Reply> refusal_of(const boost::system::error_code& error, uint64_t max_body);

// Status line and headers. `keep`: the connection stays open.
std::string head_of(const Reply& reply, bool keep);

}  // namespace postchain::service
