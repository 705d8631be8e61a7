#include "fake_passes.h"

#include <iterator>
#include <sstream>

namespace postchain::test {
namespace {

template <class P>
class FakePass : public PlainPass {
  public:
    RoleUse roles() const override { return {{Role::color}, {}, {}, {}}; }
    std::optional<Identity> identity(const PlanContext&) const override { return {}; }
    void plan(PassPlanner&) const override {}
    void reference(const PlanContext&, ReferenceFrame&) const override {}
    ParameterRef parameters() override { return &values_; }

  private:
    P values_;
};

const ParameterTable& smear_table() {
    static const ParameterTable table =
        ParameterTableBuilder<Smear>()
            .choice("mode", &Smear::mode, {"wide", "narrow"}, {.help = "how wide"})
            .integer("samples", &Smear::samples, {.min = 1, .max = 255, .odd = true})
            .number("amount", &Smear::amount, {.min = 0, .max = 10, .help = "how much | at most"})
            .integer("factor", &Smear::factor,
                     {.allowed = {1, 2, 4}, .read_if = {{{"mode", {"wide"}}}}})
            .boolean("dither", &Smear::dither, {})
            .number("shutter_frames", &Smear::shutter_frames,
                    {.min = 0, .max = 4, .unit = "frames", .excludes = "shutter_angle_deg"})
            .number("shutter_angle_deg", &Smear::shutter_angle_deg, {.min = 0, .max = 1440})
            .point("middle", &Smear::middle, {.min = 0, .max = 1})
            .table();
    return table;
}

const ParameterTable& tint_table() {
    static const ParameterTable table =
        ParameterTableBuilder<Tint>()
            .number("gain", &Tint::gain, {.min = 0, .min_excluded = true})
            .number("limit", &Tint::limit, {.min = 0, .max = 100})
            .table();
    return table;
}

}  // namespace

const PassRegistry& fake_passes() {
    static const PassRegistry registry({
        {"smear", "Smear", "Smears.", &smear_table(),
         [] { return std::make_unique<FakePass<Smear>>(); }},
        {"tint", "Tint", "Tints.", &tint_table(),
         [] { return std::make_unique<FakePass<Tint>>(); }},
    });
    return registry;
}

const Smear& smear(const Pass& pass) {
    return pass.parameters().as<Smear>();
}
const Tint& tint(const Pass& pass) {
    return pass.parameters().as<Tint>();
}

std::vector<std::string> texts(const Diagnostics& diagnostics) {
    std::vector<std::string> all;
    for (const auto& d : diagnostics) all.push_back(d.text());
    return all;
}

std::vector<std::string> places(const Diagnostics& diagnostics) {
    std::vector<std::string> all;
    for (const auto& d : diagnostics)
        all.push_back(concat(d.line, ":", d.column, " ", name_of(d.severity), " ", d.path));
    return all;
}

FileChannels file_of(const std::string& text, const std::vector<std::string>& views) {
    FileChannels file{{}, views};
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, '|');) {
        const size_t colon = part.find(':'), at = part.find('@');
        PartChannels& to = file.parts.emplace_back();
        std::istringstream channels(part.substr(colon == part.npos ? 0 : colon + 1));
        to.channels = {std::istream_iterator<std::string>(channels), {}};
        if (colon == part.npos) continue;
        to.name = part.substr(0, std::min(at, colon));
        if (at < colon) to.view = part.substr(at + 1, colon - at - 1);
    }
    return file;
}

}  // namespace postchain::test
