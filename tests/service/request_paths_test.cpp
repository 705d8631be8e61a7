// Paths in jobs: none leaves the roots, whatever its key.
#include <gmock/gmock.h>

#include <set>
#include <tuple>

#include "tests/service/request_fixture.h"
#include "tools/service/work/held_paths.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

// Every key that names files, in every form.
TEST_F(RequestTest, NoPathLeavesTheRoots) {
    fs::create_directory_symlink(base_ + "/outside", base_ + "/root/link");
    fs::create_symlink(base_ + "/outside/camera.json", base_ + "/root/link.json");
    write("root/picture_outside.json", "{\"aperture_image\": \"../outside/a.png\"}");
    write("root/frame_outside.json", "{\"frames\": {\"1\": {\"aperture_image\": \"/a.png\"}}}");
    const auto chain_with = [](const std::string& picture) {
        return json{
            {"postchain", 1}, {"camera", {{"aperture_image", picture}}}, {"passes", {"fxaa"}}};
    };
    const std::vector<std::pair<std::string, json>> attacks = {
        {"input", "../outside/in.####.exr"},
        {"input", "/in.####.exr"},
        {"input", "link/in.####.exr"},
        {"input", "color=in.####.exr,depth=../outside/d.####.exr"},
        {"input", "link/../../outside/in.0001.exr"},
        {"output", "../o.####.exr"},
        {"output", base_ + "/outside/o.####.exr"},
        {"output", "link/o.####.exr"},
        {"camera", "../outside/camera.json"},
        {"camera", "link.json"},
        {"camera", "picture_outside.json"},
        {"camera", "frame_outside.json"},
        {"profile", "../outside/profile.yaml"},
        {"profile", "/etc/passwd"},
        {"dump_stages", "../stages"},
        {"dump_stages", "link"},
        {"chain", "../outside/chain.yaml"},
        {"chain", "link/chain.yaml"},
        {"chain", "/etc/passwd"},
        {"chain", chain_with("/etc/a.png")},
        {"chain", chain_with("../outside/a.png")},
        {"set", {"camera.aperture_image=../outside/a.png"}},
        {"set", {"camera.aperture_image=/a.png"}},
        {"behind", "../outside/in.####.exr"},
        {"behind", "link/in.####.exr"},
    };
    for (const auto& [key, value] : attacks) {
        const Problem problem = refused(with(key, value).dump());
        EXPECT_EQ(problem.kind, Problem::Kind::forbidden) << key << " " << value;
        // Only a path that the client has given.
        if (value.dump().find(base_) == std::string::npos) {
            EXPECT_THAT(text_of(problem.diagnostics), Not(HasSubstr(base_ + "/outside")));
        }
    }
    const json assets = {"camera.aperture_image=../outside/a.png"};
    for (const auto& [kind, key, value] : std::vector<std::tuple<const char*, const char*, json>>{
             {"ab", "chain_b", "../outside/chain.yaml"},
             {"ab", "truth", "../outside/t.####.exr"},
             {"ab", "truth", "link/t.####.exr"},
             {"ab", "output", "../report"},
             {"ab", "assets", "link/assets"},
             {"bench", "sweep", assets}}) {
        json body = whole_;
        body.update({{"kind", kind}, {"output", "report"}});
        if (kind == std::string("ab")) body["chain_b"] = "best";
        body[key] = value;
        EXPECT_EQ(refused(body.dump()).kind, Problem::Kind::forbidden) << key << " " << value;
    }
}

TEST_F(RequestTest, OcioIsReadWithWhatUsesIt) {
    write("root/look.ocio", "ocio_profile_version: 1\n");
    json body = whole_;
    body.update({{"output", "out/o.####.png"}, {"ocio", "look.ocio"}, {"output_transfer", "view"}});
    const auto transfer = taken(body).run.picture.transfer;
    ASSERT_TRUE(transfer.has_value());
    EXPECT_EQ(std::get<io::DisplayView>(*transfer).config, base_ + "/root/look.ocio");
    body["output_transfer"] = "film";
    const Problem unknown = refused(body.dump());
    ASSERT_FALSE(unknown.diagnostics.empty());
    EXPECT_EQ(unknown.diagnostics[0].path, "output_transfer");
    EXPECT_EQ(unknown.diagnostics[0].message.find("unknown name 'film'; known are auto, linear"),
              0u)
        << unknown.diagnostics[0].message;
    body["output_transfer"] = "view";
    body["ocio"] = "/etc/passwd";
    EXPECT_EQ(refused(body.dump()).kind, Problem::Kind::forbidden);
}

TEST_F(RequestTest, TablesOfAConfigurationOfColorAreHeldUnderTheRoots) {
    json body = whole_;
    body.update({{"output", "out/o.####.png"}, {"ocio", "look.ocio"}, {"output_transfer", "view"}});
    const auto with = [&](const std::string& search, const std::string& table) {
        write("root/look.ocio",
              "ocio_profile_version: 1\nsearch_path: '" + search +
                  "'\nroles: {scene_linear: lin}\n"
                  "displays: {screen: [!<View> {name: Film, colorspace: film}]}\n"
                  "colorspaces:\n  - !<ColorSpace>\n    name: lin\n  - !<ColorSpace>\n"
                  "    name: film\n    from_reference: !<FileTransform> {src: '" +
                  table + "'}\n");
        return body.dump();
    };
    for (const auto& [search, table] :
         {std::pair{"", "a.spi1d"}, {"luts", "more/a.spi1d"}, {".:luts", "../root/a.spi1d"}}) {
        const std::string text = with(search, table);
        EXPECT_EQ(taken(json::parse(text)).run.picture.transfer.has_value(), true) << table;
    }
    std::filesystem::create_symlink("/etc/passwd", base_ + "/root/link.spi1d");
    for (const auto& [search, table] : {std::pair{"", "/etc/passwd"},
                                        {"", "../outside.spi1d"},
                                        {"/etc", "passwd"},
                                        {"..", "outside.spi1d"},
                                        {"", "/etc/none.spi1d"},
                                        {"", "link.spi1d"}}) {
        const Problem problem = refused(with(search, table));
        EXPECT_EQ(problem.kind, Problem::Kind::forbidden) << search << " " << table;
        ASSERT_EQ(problem.diagnostics.size(), 1u) << search << " " << table;
        EXPECT_EQ(problem.diagnostics[0].path, "ocio");
        EXPECT_EQ(problem.diagnostics[0].message,
                  "names a table outside the folders of this service");
    }
}

// A new row of a table that names files must be checked against the roots.
TEST_F(RequestTest, EveryTextOfTheTablesIsKnownToNameFilesOrNot) {
    const std::set<std::string> no_files = {
        "frames",          "chunk",        "cuts",      "layer",           "view",
        "layers",          "max_memory",   "no_elide",  "elide",           "compression",
        "channels",        "ocio_display", "ocio_view", "ocio_colorspace", "input_transfer",
        "output_transfer", "cryptomatte",  "fill_mask"};
    size_t files = 0;
    for (const ParameterTable* table :
         {&reader_->run_table(), &experiment::ab_parameters(), &experiment::bench_parameters()})
        for (const Parameter& row : table->rows()) {
            if (row.type != ParameterType::text) continue;
            const bool names = path_kind(row) != PathKind::none;
            EXPECT_NE(names, no_files.count(row.key) > 0) << row.key;
            files += names;
        }
    EXPECT_EQ(files, 7u + 2 * 3);
}

}  // namespace
}  // namespace postchain::service
