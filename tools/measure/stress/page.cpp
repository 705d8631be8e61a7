#include "tools/measure/stress/page.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "tools/page/page.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/png.h"

namespace postchain::stress {
namespace {

constexpr int kMaxWidth = 160;  // maximum size of the shown part, pixels
constexpr int kMaxHeight = 120;

struct Part {
    int x = 0, y = 0, width = 0, height = 0;
};

// The surroundings of the largest error, or the whole frame.
Part part_of(const ImageF& error) {
    const size_t worst = size_t(std::ranges::max_element(error.data) - error.data.begin());
    const int x = int(worst % size_t(error.width)), y = int(worst / size_t(error.width));
    Part part;
    part.width = std::min(kMaxWidth, error.width);
    part.height = std::min(kMaxHeight, error.height);
    part.x = std::clamp(x - part.width / 2, 0, error.width - part.width);
    part.y = std::clamp(y - part.height / 2, 0, error.height - part.height);
    return part;
}

void put_pixel(Image<uint8_t>& image, int x, int y, uint8_t r, uint8_t g, uint8_t b) {
    uint8_t* to = image.pixel(x, y);
    to[0] = r;
    to[1] = g;
    to[2] = b;
}

Status add_png(ImagedCheck& all, std::string title, std::string scale,
               const Image<uint8_t>& image) {
    ASSIGN_OR_RETURN(auto png, io::encode_png(image));
    all.pictures.push_back(
        {std::move(title), std::move(scale), std::move(png), image.width, image.height});
    return Status();
}

// `low` is black, `high` white, with a gamma of 2.2.
Image<uint8_t> shown(const ImageF& color, const Part& part, double low, double high) {
    Image<uint8_t> image(part.width, part.height, 3);
    for (int y = 0; y < part.height; ++y) {
        for (int x = 0; x < part.width; ++x) {
            const float* from = color.pixel(part.x + x, part.y + y);
            if (!std::all_of(from, from + 4, [](float v) { return std::isfinite(v); })) {
                put_pixel(image, x, y, 255, 0, 255);
                continue;
            }
            for (int c = 0; c < 3; ++c) {
                const double v = std::clamp((double(from[c]) - low) / (high - low), 0.0, 1.0);
                image.at(x, y, c) = uint8_t(std::lround(255 * std::pow(v, 1 / 2.2)));
            }
        }
    }
    return image;
}

Status add_error(ImagedCheck& all, const CheckImages& images, const Part& part) {
    double most = 0;
    for (float e : images.error.data)
        if (std::isfinite(e)) most = std::max(most, double(e));
    ImageF map(part.width, part.height, 1);
    for (int y = 0; y < part.height; ++y)
        for (int x = 0; x < part.width; ++x) {
            const float e = images.error.at(part.x + x, part.y + y);
            map.at(x, y) = std::isfinite(e) && most > 0 ? float(double(e) / most) : 0;
        }
    ASSIGN_OR_RETURN(auto image, io::magma_of(map));
    for (int y = 0; y < part.height; ++y)
        for (int x = 0; x < part.width; ++x)
            if (!std::isfinite(images.error.at(part.x + x, part.y + y)))
                put_pixel(image, x, y, 255, 0, 255);
    return add_png(all, images.error_is, "magma, 0 to " + number_text(most), image);
}

using io::Json;

// A failure or limit: one check of one cell, with its pictures.
Json entry_of(const CellResult& cell, const Measured& measured,
              const std::vector<ImagedCheck>& imaged) {
    Json place, pictures = Json::array();
    for (const ImagedCheck& shown : imaged) {
        if (shown.measured != &measured) continue;
        place = shown.place;
        for (const Picture& picture : shown.pictures)
            pictures.push_back({{"title", picture.title},
                                {"scale", picture.scale},
                                {"png", io::base64_of(picture.png)},
                                {"width", picture.width},
                                {"height", picture.height}});
    }
    return {{"cell", cell.name()},
            {"check", measured.check},
            {"value", number_text(measured.value)},
            {"bound", number_text(measured.bound)},
            {"note", measured.note},
            {"place", place},
            {"pictures", pictures}};
}

// Numbers are texts of three digits. `entry` of a check of a row is the index of the failure or
// limit that it shows.
Json json_of(const Matrix& matrix, const std::vector<ImagedCheck>& imaged, const PageFacts& facts) {
    std::map<const Measured*, size_t> failed;
    Json failures = Json::array();
    for (const CellResult& cell : matrix.cells)
        for (const Measured& one : cell.measured)
            if (one.verdict == Verdict::failed) {
                failed.emplace(&one, failures.size());
                failures.push_back(entry_of(cell, one, imaged));
            }

    std::map<const KnownLimit*, size_t> met;
    Json limits = Json::array();
    for (const LimitUse& use : limits_met(matrix)) {
        Json entry = entry_of(*use.worst.cell, *use.worst.measured, imaged);
        entry["limit"] = {{"check", use.limit->check},
                          {"bound", number_text(use.limit->bound)},
                          {"reason", use.limit->reason},
                          {"times", use.checks}};
        met.emplace(use.limit, limits.size());
        limits.push_back(std::move(entry));
    }

    Json checks = Json::array();
    for (const auto& row : check_rows()) checks.push_back({{"name", row.name}, {"help", row.help}});

    Json rows = Json::array();
    for (const WorstLine& line : worst_of(matrix)) {
        Json cells = Json::object();
        for (const auto& [check, worst] : line.checks) {
            const Measured& one = *worst.measured;
            Json cell = {{"cell", worst.cell->name()},
                         {"value", number_text(one.value)},
                         {"bound", number_text(one.bound)},
                         {"verdict", name_of(one.verdict)}};
            if (one.verdict == Verdict::failed) cell["entry"] = failed.at(&one);
            if (one.verdict == Verdict::limit) cell["entry"] = met.at(one.limit);
            cells[check] = std::move(cell);
        }
        rows.push_back({{"subject", line.subject}, {"row", line.row}, {"checks", cells}});
    }

    return {{"version", facts.version},
            {"renderer", facts.renderer},
            {"command", facts.command},
            {"cells", matrix.cells.size()},
            {"checked", matrix.checks()},
            {"ok", matrix.count(Verdict::ok)},
            {"limited", matrix.count(Verdict::limit)},
            {"pictured_at_most", kMaxImaged},
            {"checks", checks},
            {"rows", rows},
            {"failures", failures},
            {"limits", limits}};
}

}  // namespace

Result<ImagedCheck> imaged(const CheckImages& images) {
    ImagedCheck all;
    const Part part = part_of(images.error);
    if (part.width < images.error.width || part.height < images.error.height)
        all.place = concat(part.width, " x ", part.height, " pixels from ", part.x, ",", part.y,
                           " of ", images.error.width, " x ", images.error.height);
    struct Color {
        std::string title;
        const ImageF* image;
    };
    // Result and comparison share a scale.
    std::vector<Color> groups[] = {{{"input", &images.input}}, {{"result", &images.result}}};
    if (images.compared_is != "input") groups[1].push_back({images.compared_is, &images.compared});
    for (const auto& group : groups) {
        double low = 0, high = 0;
        for (const auto& color : group) {
            for (size_t i = 0; i < color.image->data.size(); ++i) {
                const double v = color.image->data[i];
                if (i % 4 == 3 || !std::isfinite(v)) continue;
                low = std::min(low, v);
                high = std::max(high, v);
            }
        }
        if (low == high) high = 1;
        for (const auto& color : group) {
            RETURN_IF_ERROR(add_png(all, color.title,
                                    "black is " + number_text(low) + ", white " + number_text(high),
                                    shown(*color.image, part, low, high)));
        }
    }
    RETURN_IF_ERROR(add_error(all, images, part));
    return all;
}

Result<std::vector<ImagedCheck>> pictures_of(Executor& executor,
                                             const std::vector<Subject>& subjects,
                                             const Matrix& matrix) {
    std::vector<std::pair<const CellResult*, std::set<const Measured*>>> wanted;
    std::set<const Measured*> worst;
    for (const auto& use : limits_met(matrix)) worst.insert(use.worst.measured);
    size_t failures = 0;
    for (const auto& cell : matrix.cells) {
        std::set<const Measured*> checks;
        for (const auto& one : cell.measured) {
            const bool failed = one.verdict == Verdict::failed && ++failures <= kMaxImaged;
            if (failed || worst.count(&one)) checks.insert(&one);
        }
        if (!checks.empty()) wanted.emplace_back(&cell, std::move(checks));
    }
    std::vector<ImagedCheck> all;
    for (const auto& subject : subjects) {
        const Subject prepared = with_cells_camera({subject.name, subject.chain.clone()});
        std::vector<MatrixCell> cells;  // made when first needed
        for (const auto& [result, checks] : wanted) {
            if (result->subject != subject.name) continue;
            if (cells.empty()) cells = make_cells(tile_px(prepared.chain), false);
            const auto is_of_result = [result = result](const MatrixCell& one) {
                return one.row == result->row && one.name == result->cell;
            };
            const auto cell = std::ranges::find_if(cells, is_of_result);
            if (cell == cells.end())
                return Status(StatusCode::internal, "no cell " + result->name());
            std::vector<CheckImages> images;
            std::set<std::string> names;
            for (const Measured* one : checks) names.insert(one->check);
            auto again = measure(executor, prepared, *cell, result->precision, &images, names);
            if (!again.ok()) return again.status().at(result->name());
            for (const Measured* one : checks) {
                for (const auto& made : images) {
                    if (made.check != one->check) continue;
                    auto pictures = imaged(made);
                    if (!pictures.ok()) return pictures.status().at(result->name());
                    pictures->cell = result;
                    pictures->measured = one;
                    all.push_back(std::move(*pictures));
                }
            }
        }
    }
    return all;
}

std::string matrix_as_page(const Matrix& matrix, const std::vector<ImagedCheck>& imaged,
                           const PageFacts& facts) {
    return page::with_data("stress/page.html", io::json_text(json_of(matrix, imaged, facts)));
}

}  // namespace postchain::stress
