#include "tools/scenes/scene.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <system_error>

#include "tools/scenes/deep_samples.h"
#include "tools/sequence/exr/deep_writer.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::scenes {
namespace {

constexpr const char* kLayer = "ViewLayer.";
constexpr const char* kApertureFile = "aperture.exr";

Status check_camera(const Camera& camera) {
    const auto check = [](const char* key, const std::optional<double>& value, double low,
                          bool low_allowed) -> Status {
        if (!value || (std::isfinite(*value) && (low_allowed ? *value >= low : *value > low)))
            return Status();
        return Status(StatusCode::usage, concat("camera.", key, ": ", *value, " is not ",
                                                !std::isfinite(*value) ? "finite"
                                                : low_allowed          ? concat("at least ", low)
                                                                       : concat("above ", low)));
    };
    // Aperture values have an upper limit too.
    for (const Parameter& row : camera_parameters().rows())
        if (row.key.starts_with("aperture_") || row.key == "cats_eye")
            if (Status status = row.check(row.get(&camera)); !status.ok())
                return Status(StatusCode::usage, concat("camera.", status.message()));
    if (Status status = camera_parameters().check(&camera); !status.ok())
        return Status(StatusCode::usage, concat("camera: ", status.message()));
    for (Status status : {check("focal_length_mm", camera.focal_length_mm, 0, false),
                          check("sensor_width_mm", camera.sensor_width_mm, 0, false),
                          check("f_stop", camera.f_stop, 0, false),
                          check("focus_distance", camera.focus_distance, 0, false),
                          check("near_clip", camera.near_clip, 0, false),
                          check("far_clip", camera.far_clip, 0, false),
                          check("shutter_frames", camera.shutter_frames, 0, true)})
        if (!status.ok()) return status;
    if (camera.meters_per_unit.value_or(1) != 1)
        return Status(StatusCode::usage,
                      "camera.meters_per_unit must be 1 for generated scenes, "
                      "which are in meters");
    return Status();
}

RenderSettings settings_of(const SceneRequest& request, const SceneModel& model, int frame,
                           Picture picture) {
    RenderSettings settings;
    settings.width = request.width;
    settings.height = request.height;
    settings.time = frame;
    settings.seed = uint32_t(frame);
    settings.vectors = !is_truth(picture);
    settings.samples = is_truth(picture)          ? request.truth_samples
                       : picture == Picture::gbuf ? 1
                                                  : request.sharp_samples;
    settings.behind = picture == Picture::behind || picture == Picture::deep;
    const bool shutter = picture == Picture::mb || picture == Picture::both;
    settings.shutter_frames = shutter ? *model.lens.shutter_frames : 0;
    const auto position = *model.lens.shutter_position;
    if (position != ShutterPosition::center)
        settings.shutter_center =
            (position == ShutterPosition::start ? 0.5 : -0.5) * settings.shutter_frames;
    settings.lens = picture == Picture::dof || picture == Picture::both;
    return settings;
}

Result<ScenePlanes> render_image(SceneRenderer& renderer, const SceneRequest& request,
                                 const SceneModel& model, int frame, Picture picture,
                                 const Progress& progress) {
    const RenderSettings settings = settings_of(request, model, frame, picture);
    if (is_truth(picture) && request.truth_samples < 1)
        return Status(StatusCode::usage, "the ground truth of a scene needs at least one sample");
    auto planes = renderer.render(model, settings, progress);
    if (!planes.ok() || is_truth(picture) || picture == Picture::gbuf) return planes;
    // Depth is that of the pixel center, not of the last of many samples.
    RenderSettings center = settings;
    center.samples = 1;
    ASSIGN_OR_RETURN(auto one, renderer.render(model, center));
    planes->depth = std::move(one.depth);
    return planes;
}

// Shortens values to 9 digits; 17 would be noise.
double short_of(double value) {
    char text[32];
    std::snprintf(text, sizeof(text), "%.9g", value);
    return std::strtod(text, nullptr);
}

io::Json matrix(const Pose& pose) {
    // Camera to world, right-handed as in Blender: a camera looks along its -z, so z is negated.
    // Columns: right, up, back, position.
    io::Json rows = io::Json::array();
    for (int row = 0; row < 3; ++row) {
        const double sign = row == 2 ? -1 : 1;
        io::Json values = io::Json::array();
        for (double value : {sign * pose.rotation[0][row], sign * pose.rotation[1][row],
                             -sign * pose.rotation[2][row], sign * pose.position[row]})
            values.push_back(short_of(value + 0.0));  // no -0
        rows.push_back(std::move(values));
    }
    rows.push_back({0, 0, 0, 1});
    return rows;
}

Status write_picture(const std::string& path, const ScenePlanes& planes, Picture picture,
                     io::OnExisting on_existing) {
    io::PlanesFile file;
    const bool truth = is_truth(picture);
    const std::string combined = truth ? "" : concat(kLayer, "Combined.");
    for (int c = 0; c < 4; ++c)
        file.channels.push_back({combined + "RGBA"[c], io::PixelType::half, &planes.color, c});
    if (!truth) {
        file.channels.push_back(
            {concat(kLayer, "Depth.Z"), io::PixelType::float32, &planes.depth, 0});
        for (int c = 0; c < 4; ++c)
            file.channels.push_back(
                {concat(kLayer, "Vector.", "XYZW"[c]), io::PixelType::float32, &planes.vectors, c});
    }
    io::WriteOptions options;
    options.on_existing = on_existing;
    return io::write_planes_exr(path, file, options).status();
}

std::string picture_path(const SceneRequest& request, Picture picture, int frame) {
    const auto pattern = io::PathPattern::parse(concat("/", name_of(picture), ".####.exr"));
    return request.folder + pattern->format(frame);
}

std::string camera_path(const SceneRequest& request) {
    return request.folder + "/camera.json";
}

std::string aperture_path(const SceneRequest& request) {
    return request.folder + "/" + kApertureFile;
}

io::OutputFiles files_of(const SceneRequest& request, const std::vector<Picture>& pictures) {
    io::OutputFiles files(request.on_existing);
    const std::string other = "name another folder with {output}"_keyed;
    for (int frame : request.frames)
        for (Picture picture : pictures)
            files.write(io::OutputFile{picture_path(request, picture, frame),
                                       concat("the image ", name_of(picture), " of frame ", frame),
                                       other});
    for (const auto& picture : io::inputs_of(request.camera)) files.read(picture);
    if (request.camera.aperture_image)
        files.write(io::OutputFile{aperture_path(request), "the aperture image", other});
    files.write(io::OutputFile{camera_path(request), "the camera file", other});
    return files;
}

}  // namespace

const char* name_of(Picture picture) {
    constexpr const char* kNames[] = {"gbuf", "sharp", "behind", "deep", "mb", "dof", "both"};
    return kNames[size_t(picture)];
}

bool is_truth(Picture picture) {
    return picture == Picture::mb || picture == Picture::dof || picture == Picture::both;
}

Result<SceneModel> model_for(const SceneRequest& request) {
    std::string names;
    const SceneInfo* found = nullptr;
    for (const SceneInfo& scene : scenes()) {
        names += (names.empty() ? "" : ", ") + scene.name;
        if (scene.name == request.name) found = &scene;
    }
    if (!found)
        return Status(StatusCode::usage,
                      "unknown scene '" + request.name + "'; known are " + names);
    const Camera& camera = request.camera;
    RETURN_IF_ERROR(check_camera(camera));
    SceneModel model = found->make();
    model.lens = model.lens.overlaid_by(camera);
    if (camera.focal_length_mm || camera.focus_distance)
        model.camera = [path = model.camera, camera](double time) {
            CameraPose pose = path(time);
            pose.focal_length_mm = camera.focal_length_mm.value_or(pose.focal_length_mm);
            pose.focus_distance = camera.focus_distance.value_or(pose.focus_distance);
            return pose;
        };
    return model;
}

Camera camera_at(const SceneModel& model, double frame) {
    const CameraPose pose = model.camera(frame);
    Camera camera = model.lens;
    camera.focal_length_mm = pose.focal_length_mm;
    camera.focus_distance = pose.focus_distance;
    return camera;
}

Result<ScenePlanes> render_frame(SceneRenderer& renderer, const SceneRequest& request, int frame,
                                 Picture picture, const Progress& progress) {
    ASSIGN_OR_RETURN(auto model, model_for(request));
    return render_image(renderer, request, model, frame, picture, progress);
}

std::string camera_json(const SceneRequest& request, const SceneModel& model) {
    const int first = request.frames.empty() ? 0 : request.frames.front();
    const Camera camera = camera_at(model, first);
    // Includes the frames before and after, whose matrices give the sky's motion vectors.
    std::set<int> described;
    for (int frame : request.frames) described.insert({frame - 1, frame, frame + 1});
    io::Json overrides, matrices = io::Json::object();
    for (int frame : described) {
        const Camera own = camera_at(model, frame);
        if (own != camera)
            overrides[std::to_string(frame)] = {{"focal_length_mm", short_of(*own.focal_length_mm)},
                                                {"focus_distance", short_of(*own.focus_distance)}};
        matrices[std::to_string(frame)] = matrix(model.camera(frame).pose);
    }
    std::string help;
    for (const SceneInfo& scene : scenes())
        if (scene.name == request.name) help = scene.help;
    io::Json json = {{"scene", request.name},
                     {"description", help},
                     {"resolution", {request.width, request.height}},
                     {"focal_length_mm", short_of(*camera.focal_length_mm)},
                     {"sensor_width_mm", short_of(*camera.sensor_width_mm)},
                     {"sensor_fit", "horizontal"},
                     {"f_stop", short_of(*camera.f_stop)}};
    if (camera.aperture_image) {
        json["aperture_image"] = kApertureFile;
    } else {
        json["aperture_blades"] = *camera.aperture_blades;
        json["aperture_curvature"] = short_of(*camera.aperture_curvature);
    }
    json.update(
        io::Json{{"aperture_rotation_deg", short_of(*camera.aperture_rotation_deg)},
                 {"aperture_ratio", short_of(*camera.aperture_ratio)},
                 {"cats_eye", short_of(*camera.cats_eye)},
                 {"focus_distance", short_of(*camera.focus_distance)},
                 {"meters_per_unit", 1},
                 {"near_clip", short_of(*camera.near_clip)},
                 {"far_clip", short_of(*camera.far_clip)},
                 {"shutter_frames", short_of(*camera.shutter_frames)},
                 {"shutter_position", shutter_position_names()[size_t(*camera.shutter_position)]},
                 {"fps", 24},
                 {"frames", overrides.is_null() ? io::Json(request.frames) : overrides},
                 {"z", "planar depth along the camera axis, scene units"},
                 {"background_depth", 1e10},
                 {"coc_diameter_px", "f^2/N * |z-s|/(z*s) * width/sensor, all lengths in meters"},
                 {"vector_px",
                  "X,Y = pos(prev)-pos(this); Z,W = pos(this)-pos(next); +x right, +y UP; full "
                  "inter-frame pixels"},
                 {"camera_matrix_world", matrices}});
    return io::json_text(json, 1) + "\n";
}

Status write_scene(SceneRenderer& renderer, const SceneRequest& request,
                   const SceneCallback& callback) {
    ASSIGN_OR_RETURN(auto model, model_for(request));
    if (request.frames.empty())
        return Status(StatusCode::usage, "no frames given; name some, as 1-8");
    if (request.truth_samples < 0)
        return Status(StatusCode::usage, concat("ground truth samples must be 0 or more, not ",
                                                request.truth_samples));
    std::vector<Picture> pictures = {Picture::gbuf, Picture::sharp};
    if (request.behind) pictures.push_back(Picture::behind);
    if (request.deep) pictures.push_back(Picture::deep);
    if (request.truth_samples > 0)
        pictures.insert(pictures.end(), request.truths.begin(), request.truths.end());
    const io::OutputFiles files = files_of(request, pictures);
    RETURN_IF_ERROR(files.check());
    files.remove_left_temporaries();
    std::error_code error;
    std::filesystem::create_directory(request.folder, error);
    if (error)
        return Status(StatusCode::output, request.folder + ": cannot be created: " +
                                              error.message() + "; choose another folder");
    double total = 0, before = 0;
    const auto cost = [&](Picture picture) {
        return double(settings_of(request, model, 0, picture).samples);
    };
    for (Picture picture : pictures) total += cost(picture);
    total *= double(request.frames.size());

    for (int frame : request.frames) {
        ScenePlanes sharp, behind;  // for `deep`
        for (Picture picture : pictures) {
            Progress progress;
            if (callback)
                progress = [&](double share) {
                    return callback({frame, picture, (before + share * cost(picture)) / total});
                };
            if (progress && !progress(0))
                return Status(StatusCode::canceled, "stopped while writing a scene");
            const bool rendered = picture == Picture::deep && request.behind;
            ASSIGN_OR_RETURN(auto planes, rendered ? Result<ScenePlanes>(std::move(behind))
                                                   : render_image(renderer, request, model, frame,
                                                                  picture, progress));
            const std::string path = picture_path(request, picture, frame);
            ASSIGN_OR_RETURN(const auto permit, files.permit(path));
            RETURN_IF_ERROR(
                picture == Picture::deep
                    ? io::write_deep_exr(path, deep_samples(sharp, planes), {.on_existing = permit})
                          .status()
                    : write_picture(path, planes, picture, permit));
            if (picture == Picture::sharp) sharp = std::move(planes);
            if (picture == Picture::behind) behind = std::move(planes);
            before += cost(picture);
        }
    }
    if (model.lens.aperture_image) {
        ImageF values(BokehKernel::kSide, BokehKernel::kSide, 1);
        values.data = model.lens.aperture_image.values();
        ASSIGN_OR_RETURN(const auto permit, files.permit(aperture_path(request)));
        ASSIGN_OR_RETURN(const auto written,
                         io::write_planes_exr(aperture_path(request), values, {"Y"}, permit));
    }
    return files.put(camera_path(request), camera_json(request, model));
}

}  // namespace postchain::scenes
