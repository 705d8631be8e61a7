#include "tools/openfx/conventions.h"

#include "config/profile.h"

namespace postchain::openfx {
namespace {

// Vectors that go up, in an image whose rows go down.
MotionConvention up(MotionUnit unit, double scale) {
    return {.unit = unit, .scale_x = scale, .scale_y = -scale};
}

// "Vector.Z" -> "Vector" and 2: the place of a channel in a layer of four.
std::string layer_of(const std::string& channel) {
    return channel.substr(0, channel.rfind('.') + 1);
}
int place_of(const std::string& channel) {
    const std::string_view last = std::string_view(channel).substr(channel.rfind('.') + 1);
    return last == "B" || last == "Z" ? 2 : 0;
}

MotionMeaning meaning_of(const Profile& profile) {
    MotionMeaning meaning{.name = profile.name, .help = profile.title};
    const RoleSource& forward = profile.roles.at(Role::motion).front();
    meaning.forward = forward.motion;
    const auto back = profile.roles.find(Role::motion_back);
    if (back == profile.roles.end()) return meaning;
    meaning.back = back->second.front().motion;
    const std::string &to_next = forward.channels.front().front(),
                      &to_previous = back->second.front().channels.front().front();
    if (layer_of(to_next) != layer_of(to_previous)) return meaning;
    meaning.forward_at = place_of(to_next);
    meaning.back_at = place_of(to_previous);
    return meaning;
}

}  // namespace

const std::vector<MotionMeaning>& motion_meanings() {
    static const std::vector<MotionMeaning> meanings = [] {
        std::vector<MotionMeaning> all = {
            {.name = "to_next",
             .help = "pixels from this frame to the next, y up",
             .forward = up(MotionUnit::pixels, 1),
             .back = {}},
            {.name = "from_previous",
             .help = "pixels from the previous frame to this one, y up, taken for the way to the "
                     "next",
             .forward = up(MotionUnit::pixels, 1),
             .back = {}},
            {.name = "to_previous",
             .help = "pixels from this frame to the previous one, y up, reversed for the way to "
                     "the next",
             .forward = up(MotionUnit::pixels, -1),
             .back = {}},
            {.name = "uv",
             .help = "fractions of the frame's width and height to the next frame, y up",
             .forward = up(MotionUnit::fraction, 1),
             .back = {}},
            {.name = "ndc",
             .help = "normalized device coordinates to the next frame, -1 to 1 across the frame, "
                     "y up",
             .forward = up(MotionUnit::fraction, 0.5),
             .back = {}}};
        for (const Profile& profile : builtin_profiles())
            if (profile.roles.contains(Role::motion)) all.push_back(meaning_of(profile));
        return all;
    }();
    return meanings;
}

const std::vector<std::string>& motion_channel_names() {
    static const std::vector<std::string> names = {"as motion_meaning has them", "RG forward",
                                                   "BA forward", "RG forward, BA backward",
                                                   "BA forward, RG backward"};
    return names;
}

const std::vector<std::string>& depth_meaning_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all = depth_encoding_names();
        all.insert(all.end(), {"normalized", "normalized_inverted"});
        return all;
    }();
    return names;
}

const std::vector<std::string>& channel_names() {
    static const std::vector<std::string> names = {"R", "G", "B", "A"};
    return names;
}

Result<Conventions> read_conventions(const Values& values, double scale_x, double scale_y) {
    Conventions conventions;
    if (values.has(kMotionMeaning)) {
        const auto& meanings = motion_meanings();
        ASSIGN_OR_RETURN(const size_t at, values.choice(kMotionMeaning, meanings.size()));
        ASSIGN_OR_RETURN(const size_t channels,
                         values.choice(kMotionChannels, motion_channel_names().size()));
        const MotionMeaning& meaning = meanings[at];
        conventions.meaning = &meaning;
        conventions.forward_at = meaning.forward_at;
        conventions.back_at = meaning.back ? meaning.back_at : -1;
        switch (channels) {
            case 1:
                conventions.forward_at = 0, conventions.back_at = -1;
                break;
            case 2:
                conventions.forward_at = 2, conventions.back_at = -1;
                break;
            case 3:
                conventions.forward_at = 0, conventions.back_at = 2;
                break;
            case 4:
                conventions.forward_at = 2, conventions.back_at = 0;
                break;
        }
        const auto factor = values.point(kMotionScale);
        const auto scaled = [&](MotionConvention motion) {
            const bool pixels = motion.unit == MotionUnit::pixels;
            motion.scale_x *= factor[0] * (pixels ? scale_x : 1);
            motion.scale_y *= factor[1] * (pixels ? scale_y : 1);
            return motion;
        };
        conventions.options.motion = scaled(meaning.forward);
        // Vectors of a meaning without a direction back point to the previous frame.
        MotionConvention back = meaning.back.value_or(meaning.forward);
        if (!meaning.back) back.scale_x = -back.scale_x, back.scale_y = -back.scale_y;
        conventions.options.motion_back = scaled(back);
    }
    if (values.has(kDepthMeaning)) {
        const size_t encodings = depth_encoding_names().size();
        ASSIGN_OR_RETURN(const size_t encoding,
                         values.choice(kDepthMeaning, depth_meaning_names().size()));
        ASSIGN_OR_RETURN(const size_t channel,
                         values.choice(kDepthChannel, channel_names().size()));
        conventions.depth_at = int(channel);
        if (encoding < encodings)
            conventions.options.depth = DepthEncoding(encoding);
        else
            conventions.normalized = encoding == encodings ? Conventions::Normalized::near_is_0
                                                           : Conventions::Normalized::near_is_1;
    }
    if (values.has(kMatteChannel)) {
        ASSIGN_OR_RETURN(const size_t channel,
                         values.choice(kMatteChannel, channel_names().size()));
        conventions.matte_at = int(channel);
    }
    return conventions;
}

std::string Conventions::text() const {
    const auto text_of = [](const MotionConvention& motion) {
        return concat(" ", motion.scale_x, " ", motion.scale_y);
    };
    return concat(meaning ? meaning->name : "", " ", forward_at, " ", back_at,
                  text_of(options.motion), text_of(options.motion_back));
}

}  // namespace postchain::openfx
