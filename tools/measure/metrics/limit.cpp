#include "tools/measure/metrics/limit.h"

#include <charconv>
#include <cmath>

namespace postchain::metrics {

Result<MetricLimit> parse_limit(const std::string& option, const std::string& text) {
    const size_t equals = text.find('=');
    MetricLimit limit{text.substr(0, equals), 0};
    const char* end = text.data() + text.size();
    const char* begin = equals == std::string::npos ? end : text.data() + equals + 1;
    const auto parsed = std::from_chars(begin, end, limit.value);
    if (parsed.ec != std::errc() || parsed.ptr != end || !std::isfinite(limit.value))
        return Status(StatusCode::usage,
                      option + ": '" + text + "' is not METRIC=NUMBER, e.g. flip=0.05");
    return limit;
}

std::string nonfinite_fault(const std::vector<MetricLimit>& limits, double pixels) {
    if (limits.empty() || !(pixels > 0)) return "";
    for (const auto& limit : limits)
        if (limit.metric == "nonfinite") return "";  // judged as the other metrics
    return concat("NaN or infinite pixels: ", pixels,
                  ", which every other metric reads as 0; mend the image, or allow them with "
                  "nonfinite=",
                  pixels);
}

}  // namespace postchain::metrics
