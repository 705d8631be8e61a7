#include "tests/support/variants.h"

#include <algorithm>

namespace postchain::test {
namespace {

using Link = Variant::Link;
using Values = std::vector<std::pair<std::string, ParameterValue>>;

Link guertin(Values values = {}) {
    values.insert(values.begin(), {{"mode", "guertin"}, {"max_blur_px", int64_t(16)}});
    return {"motion_blur", std::move(values)};
}
Link gilham(Values values = {}) {
    values.insert(values.begin(), {"method", "gilham"});
    return {"depth_of_field", std::move(values)};
}
Link depth_of_field(Values values) {
    return {"depth_of_field", std::move(values)};
}
Link joint_blur(Values values) {
    return {"joint_blur", std::move(values)};
}
Link fxaa(Values values) {
    return {"fxaa", std::move(values)};
}

// The report's filter and gilham's round alike on the GPU, but for taps at the border of two
// pixels.
Variant plain(const char* name, Link link, double share = 0.002) {
    return {name, {std::move(link)}, 1e-4, share};
}
// Both of FXAA's edge scores are often the same sum, which double precision rounds its own way.
Variant search(const char* name, Values values) {
    return {name, {fxaa(std::move(values))}, 1e-3, 0.02};
}

}  // namespace

const std::vector<Variant>& main_variants() {
    static const std::vector<Variant> all = {
        {"motion_blur", {{"motion_blur"}}},
        plain("guertin", guertin()),
        plain("guertin_variance", guertin({{"sample_split", "variance"}, {"jitter", 0.0}})),
        plain("guertin_unorm8", guertin({{"velocity_storage", "unorm8"}})),
        {"depth_of_field", {depth_of_field({{"max_radius_px", 14.0}})}},
        plain("gilham", gilham({{"leak", "coc"}, {"hdr_weight", true}, {"downsample", int64_t(2)}}),
              0.001),
        {"joint_blur", {joint_blur({{"max_radius_px", 14.0}})}},
        search("fxaa", {}),
        plain("fxaa_directional", fxaa({{"mode", "directional"}}), 0),
        {"chain",
         {guertin(), gilham(), fxaa({{"hint", "checkerboard"}, {"hint_gate", "pixel"}})},
         1e-3,
         0.02},
        plain("vignette", {"vignette"}, 0),
        plain("echo", {"echo"}, 0),
    };
    return all;
}

const std::vector<Variant>& more_variants() {
    static const std::vector<Variant> all = {
        {"motion_blur_alone", {{"motion_blur", {{"neighbors", "none"}, {"noise", "ign"}}}}},
        {"motion_blur_before", {{"motion_blur", {{"neighbors", "before"}}}}},
        {"motion_blur_few",
         {{"motion_blur", {{"samples", int64_t(7)}, {"starts", int64_t(1)}, {"noise", "ign"}}}}},
        {"motion_blur_short",
         {{"motion_blur",
           {{"starts", int64_t(8)}, {"max_blur_px", int64_t(9)}, {"noise", "none"}}}}},
        plain("guertin_plain", guertin({{"jitter", 0.0}, {"tile_jitter", false}})),
        plain("guertin_default_tiles", {"motion_blur", {{"mode", "guertin"}}}),
        plain("guertin_ign", guertin({{"noise", "ign"}, {"seed", int64_t(3)}})),
        plain("guertin_blue",
              guertin({{"noise", "blue"}, {"seed", int64_t(99)}, {"animate_noise", true}})),
        plain("guertin_no_noise", guertin({{"noise", "none"}})),
        plain("guertin_dominant",
              guertin({{"static_direction", "dominant"}, {"variance_threshold_px", 6.0}})),
        plain("guertin_steep", guertin({{"depth_softness", 20.0}, {"min_speed_px", 9.0}})),
        plain("guertin_depthless", guertin({{"depth_softness", 0.0}, {"shutter_angle_deg", 77.0}})),
        plain("guertin_slope", guertin({{"tile_jitter_slope", 0.2}, {"samples", int64_t(9)}})),
        plain("guertin_one_tap", guertin({{"samples", int64_t(1)}, {"center_weight", 3.0}})),
        plain("guertin_fp32", guertin({{"velocity_storage", "fp32"}})),
        plain("guertin_fp16", guertin({{"velocity_storage", "fp16"}})),
        plain("single_clamp", guertin({{"mode", "single"}, {"border", "clamp"}})),
        {"depth_of_field_noisy", {depth_of_field({{"denoise", false}, {"samples", int64_t(40)}})}},
        {"depth_of_field_few",
         {depth_of_field({{"samples", int64_t(7)}, {"starts", int64_t(1)}, {"noise", "blue"}})}},
        {"depth_of_field_range", {depth_of_field({{"coc", "range"}, {"noise", "none"}})}},
        {"depth_of_field_blades",
         {depth_of_field({{"aperture_blades", int64_t(5)},
                          {"aperture_curvature", 0.4},
                          {"aperture_ratio", 1.6},
                          {"cats_eye", 0.9}})}},
        // Every value of each row of parameters beside every value of each other one.
        plain("gilham_lens_none_1",
              gilham({{"leak", "none"}, {"downsample", int64_t(1)}, {"blur_sigma_px", 2.0}}),
              0.001),
        plain("gilham_lens_depth_2",
              gilham({{"leak", "depth"}, {"downsample", int64_t(2)}, {"hdr_weight", true}}), 0.001),
        plain("gilham_lens_coc_4", gilham({{"leak", "coc"}, {"downsample", int64_t(4)}}), 0.001),
        plain("gilham_planes_none_2",
              gilham({{"coc", "planes"}, {"leak", "none"}, {"downsample", int64_t(2)}}), 0.001),
        plain("gilham_planes_depth_4",
              gilham({{"coc", "planes"}, {"leak", "depth"}, {"downsample", int64_t(4)}}), 0.001),
        plain("gilham_planes_coc_1",
              gilham({{"coc", "planes"},
                      {"leak", "coc"},
                      {"downsample", int64_t(1)},
                      {"hdr_weight", true}}),
              0.001),
        plain("gilham_range_none_4",
              gilham({{"coc", "range"},
                      {"leak", "none"},
                      {"downsample", int64_t(4)},
                      {"hdr_weight", true},
                      {"blur_sigma_px", 5.0}}),
              0.001),
        plain("gilham_range_depth_1",
              gilham({{"coc", "range"}, {"leak", "depth"}, {"downsample", int64_t(1)}}), 0.001),
        plain("gilham_range_coc_2",
              gilham({{"coc", "range"}, {"leak", "coc"}, {"downsample", int64_t(2)}}), 0.001),
        {"joint_blur_alone",
         {joint_blur({{"neighbors", "none"}, {"samples", int64_t(33)}, {"denoise", false}})}},
        {"joint_blur_few", {joint_blur({{"samples", int64_t(19)}, {"starts", int64_t(1)}})}},
        search("fxaa_stored", {{"luma", "stored"}, {"blend", "stored"}}),
        search("fxaa_exposed", {{"exposure_ev", -3.0}, {"preset", int64_t(39)}}),
        search("fxaa_10", {{"preset", int64_t(10)}, {"subpix", 1.0}, {"blend", "stored"}}),
        search("fxaa_29", {{"preset", int64_t(29)}, {"edge_threshold", 0.0}}),
        plain("directional_stored",
              fxaa({{"mode", "directional"}, {"luma", "stored"}, {"blend", "stored"}}), 0),
        plain("directional_exposed", fxaa({{"mode", "directional"}, {"exposure_ev", 4.0}}), 0),
        {"guertin_fxaa_threshold", {guertin(), fxaa({{"hint", "threshold"}})}, 1e-3, 0.04},
        {"guertin_directional_checkerboard",
         {guertin(), fxaa({{"mode", "directional"}, {"hint", "checkerboard"}})}},
        {"motion_blur_gilham_fxaa", {{"motion_blur"}, gilham(), fxaa({{"hint", "checkerboard"}})}},
        {"joint_blur_fxaa_motion_blur",
         {{"joint_blur"}, fxaa({{"mode", "directional"}}), {"motion_blur"}}},
    };
    return all;
}

const std::vector<Variant>& one_of_each_kind() {
    static const std::vector<Variant> all = [] {
        std::vector<Variant> some;
        for (const Variant& one : main_variants())
            for (const char* name : {"joint_blur", "guertin", "gilham", "fxaa"})
                if (one.name == name) some.push_back(one);
        return some;
    }();
    return all;
}

Chain Variant::chain() const {
    Chain chain;
    for (const Link& link : links) {
        append(chain, link.type);
        const ParameterTable& table = *every_pass().find(link.type)->parameters;
        for (const auto& [key, value] : link.settings) {
            const Status status = table.set(chain.links.back().pass->parameters(), key, value);
            EXPECT_TRUE(status.ok()) << name << ": " << status.message();
        }
    }
    return chain;
}

void PrintTo(const Variant& variant, std::ostream* out) {
    *out << variant.name;
}

std::vector<Variant> variants_that(const std::vector<Variant>& all,
                                   const std::function<bool(const Chain&)>& have) {
    std::vector<Variant> some;
    for (const Variant& one : all)
        if (have(one.chain())) some.push_back(one);
    return some;
}

bool reads_motion(const Chain& chain) {
    return chain.required().has(Role::motion);
}

bool warps(const Chain& chain) {
    return chain.links.size() == 1 && chain.optional().has(Role::behind);
}

bool any_chain(const Chain&) {
    return true;
}

}  // namespace postchain::test
