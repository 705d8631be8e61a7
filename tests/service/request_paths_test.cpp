// Paths in jobs: none leaves the roots, whatever its key.
#include <gmock/gmock.h>

#include <set>

#include "tests/service/request_fixture.h"
#include "tools/service/work/request_body.h"

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
    const json sets = {"camera.aperture_image=../outside/a.png"};
    const std::vector<std::pair<std::string, std::vector<json>>> attacks = {
        {"input",
         {"../outside/in.####.exr", "/in.####.exr", "link/in.####.exr",
          "color=in.####.exr,depth=../outside/d.####.exr", "link/../../outside/in.0001.exr"}},
        {"output", {"../o.####.exr", base_ + "/outside/o.####.exr", "link/o.####.exr"}},
        {"camera",
         {"../outside/camera.json", "link.json", "picture_outside.json", "frame_outside.json"}},
        {"profile", {"../outside/profile.yaml", "/etc/passwd"}},
        {"dump_stages", {"../stages", "link"}},
        {"chain",
         {"../outside/chain.yaml", "link/chain.yaml", "/etc/passwd", chain_with("/etc/a.png"),
          chain_with("../outside/a.png")}},
        {"set", {sets, json::array({"camera.aperture_image=/a.png"})}},
        {"behind", {"../outside/in.####.exr", "link/in.####.exr"}},
    };
    for (const auto& [key, values] : attacks)
        for (const json& value : values) {
            const Problem problem = refused(with(key, value));
            EXPECT_EQ(problem.kind, Problem::Kind::forbidden) << key << " " << value;
            // Only a path that the client has given.
            if (value.dump().find(base_) == std::string::npos) {
                EXPECT_THAT(text_of(problem.diagnostics), Not(HasSubstr(base_ + "/outside")));
            }
        }
    const json ab = {{"kind", "ab"}, {"output", "report"}, {"chain_b", "best"}};
    for (const json& body :
         {json{{"chain_b", "../outside/chain.yaml"}}, json{{"truth", "../outside/t.####.exr"}},
          json{{"truth", "link/t.####.exr"}}, json{{"output", "../report"}},
          json{{"assets", "link/assets"}},
          json{{"kind", "bench"}, {"chain_b", nullptr}, {"sweep", sets}}}) {
        json measured = with(ab);
        measured.merge_patch(body);
        EXPECT_EQ(refused(measured).kind, Problem::Kind::forbidden) << body;
    }
}

TEST_F(RequestTest, OcioIsReadWithWhatUsesIt) {
    write("root/look.ocio", "ocio_profile_version: 1\n");
    json body =
        with({{"output", "out/o.####.png"}, {"ocio", "look.ocio"}, {"output_transfer", "view"}});
    const auto transfer = taken(body).run.picture.transfer;
    ASSERT_TRUE(transfer.has_value());
    EXPECT_EQ(std::get<io::DisplayView>(*transfer).config, base_ + "/root/look.ocio");
    body["output_transfer"] = "film";
    const Problem unknown = refused(body);
    EXPECT_EQ(unknown.diagnostics.at(0).path, "output_transfer");
    EXPECT_THAT(unknown.diagnostics[0].message,
                HasSubstr("unknown name 'film'; known are auto, linear"));
    body["output_transfer"] = "view";
    body["ocio"] = "/etc/passwd";
    EXPECT_EQ(refused(body).kind, Problem::Kind::forbidden);
}

TEST_F(RequestTest, TablesOfAConfigurationOfColorAreHeldUnderTheRoots) {
    const json body =
        with({{"output", "out/o.####.png"}, {"ocio", "look.ocio"}, {"output_transfer", "view"}});
    const auto write_look = [&](const std::string& search, const std::string& table) {
        write("root/look.ocio",
              "ocio_profile_version: 1\nsearch_path: '" + search +
                  "'\nroles: {scene_linear: lin}\n"
                  "displays: {screen: [!<View> {name: Film, colorspace: film}]}\n"
                  "colorspaces:\n  - !<ColorSpace>\n    name: lin\n  - !<ColorSpace>\n"
                  "    name: film\n    from_reference: !<FileTransform> {src: '" +
                  table + "'}\n");
    };
    for (const auto& [search, table] :
         {std::pair{"", "a.spi1d"}, {"luts", "more/a.spi1d"}, {".:luts", "../root/a.spi1d"}}) {
        write_look(search, table);
        EXPECT_TRUE(taken(body).run.picture.transfer.has_value()) << table;
    }
    std::filesystem::create_symlink("/etc/passwd", base_ + "/root/link.spi1d");
    for (const auto& [search, table] : {std::pair{"", "/etc/passwd"},
                                        {"", "../outside.spi1d"},
                                        {"/etc", "passwd"},
                                        {"..", "outside.spi1d"},
                                        {"", "/etc/none.spi1d"},
                                        {"", "link.spi1d"}}) {
        write_look(search, table);
        const Problem problem = refused(body);
        EXPECT_EQ(problem.kind, Problem::Kind::forbidden) << search << " " << table;
        ASSERT_EQ(problem.diagnostics.size(), 1u) << search << " " << table;
        EXPECT_EQ(problem.diagnostics[0].path, "ocio");
        EXPECT_EQ(problem.diagnostics[0].message,
                  "names a table outside the folders of this service");
    }
}

// A new row of a table that names files must be checked against the roots.
TEST_F(RequestTest, EveryTextOfTheTablesIsKnownToNameFilesOrNot) {
    const std::set<std::string> no_files = {"frames",         "chunk",
                                            "cuts",           "view_layer",
                                            "view",           "aovs",
                                            "max_memory",     "no_elide",
                                            "elide",          "compression",
                                            "channels",       "ocio_display",
                                            "ocio_view",      "ocio_colorspace",
                                            "input_transfer", "output_transfer",
                                            "cryptomatte",    "fill_mask"};
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
