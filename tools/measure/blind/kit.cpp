#include "tools/measure/blind/kit.h"

#include <map>

#include "chain/parameter.h"
#include "tools/page/page.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/png.h"

namespace postchain::blind {
namespace {

using io::Json;

// Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}
    // 0 .. n - 1; the bias for the small n here is below 1e-15.
    size_t below(size_t n) {
        uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return size_t((z ^ (z >> 31)) % n);
    }

  private:
    uint64_t state_;
};

std::string words_of(const Kit& kit) {
    std::string text = kit.images + "\n";
    for (const auto& side : kit.sides) text += side + "\n";
    for (const Trial& trial : kit.trials)
        text += concat(trial.frame, " ", trial.left, " ", trial.right, "\n");
    return text;
}

}  // namespace

Kit make_kit(const std::vector<std::string>& sides, const std::vector<int>& frames, uint64_t seed,
             const std::vector<Picture>& pictures) {
    Kit kit;
    kit.sides = sides;
    std::string hashes;
    for (const Picture& one : pictures) hashes += hex_of(hash_text(one.png));
    kit.images = hex_of(hash_text(hashes));
    Random random(seed);
    for (const int frame : frames)
        for (size_t b = 1; b < sides.size(); ++b)
            for (size_t a = 0; a < b; ++a)
                kit.trials.push_back(random.below(2) ? Trial{frame, b, a} : Trial{frame, a, b});
    for (size_t i = kit.trials.size(); i > 1; --i)
        std::swap(kit.trials[i - 1], kit.trials[random.below(i)]);
    kit.id = hex_of(hash_text(words_of(kit)));
    return kit;
}

std::string key_text(const Kit& kit) {
    Json trials = Json::array();
    for (const Trial& trial : kit.trials)
        trials.push_back({{"frame", trial.frame},
                          {"left", kit.sides[trial.left]},
                          {"right", kit.sides[trial.right]}});
    return io::json_text({{"postchain_blind", 1},
                          {"kit", kit.id},
                          {"images", kit.images},
                          {"sides", kit.sides},
                          {"trials", trials}},
                         1) +
           "\n";
}

Result<Kit> kit_from(const std::string& text, const std::string& file_name) {
    Kit kit;
    try {
        const Json json = Json::parse(text);
        kit.id = json.at("kit").get<std::string>();
        kit.images = json.at("images").get<std::string>();
        kit.sides = json.at("sides").get<std::vector<std::string>>();
        std::map<std::string, size_t> index;
        for (size_t s = 0; s < kit.sides.size(); ++s) index[kit.sides[s]] = s;
        for (const Json& trial : json.at("trials"))
            kit.trials.push_back({trial.at("frame").get<int>(),
                                  index.at(trial.at("left").get<std::string>()),
                                  index.at(trial.at("right").get<std::string>())});
        if (json.at("postchain_blind") == 1 && kit.id == hex_of(hash_text(words_of(kit))))
            return kit;
    } catch (const std::exception&) {
    }
    return Status(StatusCode::input,
                  file_name +
                      ": is not the key of a blind comparison, or was changed; make the "
                      "folder again with postchain blind");
}

std::string page_of(const Kit& kit, const std::vector<Picture>& pictures) {
    // In an order that says nothing about sides.
    std::map<std::pair<int, size_t>, size_t> given;
    Json trials = Json::array(), images = Json::array();
    const auto index_of = [&](int frame, size_t side) -> Json {
        for (const Picture& picture : pictures) {
            if (picture.frame != frame || picture.side != side) continue;
            const auto [at, added] = given.emplace(std::pair(frame, side), images.size());
            if (added) images.push_back(io::base64_of(picture.png));
            return at->second;
        }
        return Json();
    };
    for (const Trial& trial : kit.trials) {
        const Json left = index_of(trial.frame, trial.left);
        const Json right = index_of(trial.frame, trial.right);
        trials.push_back(
            {{"left", left}, {"right", right}, {"truth", index_of(trial.frame, kit.sides.size())}});
    }
    return page::with_data(
        "blind/page.html",
        io::json_text({{"kit", kit.id}, {"trials", trials}, {"images", images}}));
}

}  // namespace postchain::blind
