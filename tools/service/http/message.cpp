#include "tools/service/http/message.h"

#include <unistd.h>

#include <algorithm>
#include <boost/algorithm/string/split.hpp>
#include <boost/beast/http/status.hpp>

#include "tools/service/http/job_json.h"

namespace postchain::service {
namespace {

using io::Json;

constexpr size_t kPart = 256 * 1024;  // bytes of a file, read at a time
constexpr const char* kProblemType = "application/problem+json";

std::optional<std::string> decoded(std::string_view text, bool plus_is_space) {
    std::string out;
    for (size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            out += text[i] == '+' && plus_is_space ? ' ' : text[i];
            continue;
        }
        unsigned value = 0;
        const char* digits = text.data() + i + 1;
        const char* end = text.data() + std::min(i + 3, text.size());
        if (std::from_chars(digits, end, value, 16).ptr - digits != 2) return std::nullopt;
        out += char(value);
        i += 2;
    }
    const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
    if (std::ranges::any_of(out, is_control)) return std::nullopt;
    return out;
}

bool is_safe_segment(const std::string& segment) {
    return segment != "." && segment != ".." && segment.find_first_of("/\\") == std::string::npos;
}

Reply reply_of(int status, const std::string& detail, const Diagnostics& diagnostics) {
    Json body = {{"type", "about:blank"}, {"title", reason_of(status)}, {"status", status}};
    body["detail"] = detail;
    if (!diagnostics.empty()) body["errors"] = json_of(diagnostics);
    Reply reply;
    reply.status = status;
    reply.type = kProblemType;
    reply.body = io::json_text(body) + "\n";
    return reply;
}

}  // namespace

std::vector<std::string> parts_of(std::string_view text, char separator) {
    std::vector<std::string> parts;
    boost::split(parts, text, [&](char c) { return c == separator; });
    return parts;
}

const std::string* Request::header(std::string_view name) const {
    for (const auto& [key, value] : headers)
        if (same_word(key, name)) return &value;
    return nullptr;
}

size_t Request::count(std::string_view name) const {
    return size_t(std::ranges::count_if(
        headers, [&](const auto& one) { return same_word(one.first, name); }));
}

// ----------------------------------------------------------------------------------------- files
FileBody::FileBody(const ResultFile& file, std::vector<FilePart> parts)
    : name_(file.name), parts_(std::move(parts)), file_(file.path) {
    for (const FilePart& part : parts_) bytes_ += part.end - part.begin;
}

Result<std::string> FileBody::next() {
    while (at_ < parts_.size() && parts_[at_].begin == parts_[at_].end) ++at_;
    if (at_ == parts_.size()) return std::string();
    FilePart& left = parts_[at_];
    std::string read(size_t(std::min<uint64_t>(left.end - left.begin, kPart)), '\0');
    const ssize_t got = ::pread(file_.fd(), read.data(), read.size(), off_t(left.begin));
    if (got <= 0) return Status(StatusCode::input, name_ + ": was changed while it was sent");
    read.resize(size_t(got));
    left.begin += read.size();
    return read;
}

Reply parts_reply(const ResultFile& file, std::vector<FilePart> parts) {
    Reply reply;
    reply.type = file.type;
    reply.file = std::make_shared<FileBody>(file, std::move(parts));
    return reply;
}

Reply file_reply(const ResultFile& file) {
    return parts_reply(file, {{0, file.bytes}});
}

Reply download_reply(const ResultFile& file) {
    std::string plain;
    for (const char c : file.name)
        plain += c >= 0x20 && c < 0x7f && c != '"' && c != '\\' ? c : '_';
    Reply reply = file_reply(file);
    reply.headers.emplace_back("Content-Disposition", "attachment; filename=\"" + plain + "\"");
    return reply;
}

// -------------------------------------------------------------------------------------- problems
Reply problem(int status, const std::string& detail, int retry_after_s) {
    Reply reply = reply_of(status, detail, {});
    if (retry_after_s > 0) reply.headers.emplace_back("Retry-After", std::to_string(retry_after_s));
    return reply;
}

Reply problem(const Problem& what) {
    constexpr int kStatuses[] = {422, 404, 409, 403, 429, 503, 500};  // as Problem::Kind
    Reply reply = reply_of(kStatuses[size_t(what.kind)], what.detail, what.diagnostics);
    if (what.kind == Problem::Kind::busy || what.kind == Problem::Kind::unavailable)
        reply.headers.emplace_back("Retry-After", std::to_string(std::max(1, what.retry_after_s)));
    return reply;
}

void name_request(Reply& reply, const std::string& id) {
    if (reply.type != kProblemType) return;
    Json body = Json::parse(reply.body);
    body["request_id"] = id;
    reply.body = io::json_text(body) + "\n";
}

std::string reason_of(int status) {
    // RFC 9110 has renamed these two.
    if (status == 413) return "Content Too Large";
    if (status == 422) return "Unprocessable Content";
    return std::string(
        boost::beast::http::obsolete_reason(boost::beast::http::int_to_status(unsigned(status))));
}

// --------------------------------------------------------------------------------------- targets
std::optional<Target> parse_target(std::string_view text) {
    if (!text.starts_with('/') || text.find('#') != std::string_view::npos) return std::nullopt;
    const size_t question = std::min(text.find('?'), text.size());
    Target target;
    for (const std::string& part : parts_of(text.substr(1, question - 1), '/')) {
        auto segment = decoded(part, false);
        if (!segment || !is_safe_segment(*segment)) return std::nullopt;
        target.segments.push_back(std::move(*segment));
    }
    if (question == text.size()) return target;
    for (const std::string& pair : parts_of(text.substr(question + 1), '&')) {
        if (pair.empty()) continue;
        const size_t equals = std::min(pair.find('='), pair.size());
        auto key = decoded(pair.substr(0, equals), true);
        auto value = decoded(pair.substr(std::min(equals + 1, pair.size())), true);
        if (!key || !value) return std::nullopt;
        if (!target.query.emplace(std::move(*key), std::move(*value)).second) return std::nullopt;
    }
    return target;
}

}  // namespace postchain::service
