#include "measure/marker_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include <nlohmann/json.hpp>

#include <lightwell/files.hpp>
#include <lightwell/query.hpp>

#include "measure/direction_error.hpp"

namespace lightwell::measure {

namespace {

using nlohmann::json;

constexpr double kDegree = std::numbers::pi / 180;
/// Limits of the classes. A face counts from a cosine of 0.2 to the camera: closer to its plane its patches are too
/// narrow. A shadow counts if it covers a tenth of the body's square in the picture and takes a fifth of the table's
/// light; a table is weakly patterned if its albedo varies by at most a tenth (RMS over squares of 5 mm).
constexpr double kLitShare = 0.6, kMinViewCosine = 0.2, kMinShadowArea = 0.1, kMinShadowDepth = 0.2,
                 kMaxTableContrast = 0.1;
constexpr int kMinLitFaces = 2;

Vec3d vector_of(const json& v) { return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()}; }

RigParameters rig_of(const json& of) {
  LensParameters lens;
  lens.width = of.at("width");
  lens.height = of.at("height");
  MeiParameters pinhole;
  pinhole.fx = pinhole.fy = of.at("focal_px");
  pinhole.cx = of.at("center_px").at(0);
  pinhole.cy = of.at("center_px").at(1);
  lens.model = pinhole;
  // The widest frame of the scenes, 1280x960 at 500 px, has its corners at 58 degrees. Beyond it, the polynomial of the
  // vignetting may leave no light.
  lens.max_angle_rad = 1.02;
  lens.pose_cv = {upright_lens_cv(), {}};
  lens.photometry.response.kind = ResponseCurve::Kind::srgb;
  lens.photometry.read_noise = of.at("read_noise");
  lens.photometry.shot_noise = of.at("shot_noise");
  lens.photometry.vignetting = of.at("vignetting").get<std::array<double, 3>>();
  RigParameters rig;
  rig.lenses = {lens};
  return rig;
}

SceneClass class_of(const json& of) {
  int lit = 0;
  for (const json& face : of.at("faces"))
    lit += face.at("cosine").get<double>() >= kMinViewCosine && face.at("strongest_share").get<double>() >= kLitShare;
  if (lit >= kMinLitFaces) return SceneClass::lit_faces;
  const double size = of.at("size_px");
  const bool behind = std::abs(of.at("lamps").at(0).at("azimuth_deg").get<double>()) > 90;
  const bool shadow = of.at("shadow_px").get<double>() >= kMinShadowArea * size * size &&
                      of.at("shadow_depth").get<double>() >= kMinShadowDepth;
  const bool plain = of.at("table").at("contrast").get<double>() <= kMaxTableContrast;
  return behind && shadow && plain ? SceneClass::shadow_behind : SceneClass::other;
}

/// `first_gain`: of the green channel, of a sequence's first frame; set if this is one.
MarkerScene scene_of(const json& of, const std::vector<Vec3d>& normals, double& first_gain) {
  MarkerScene scene;
  scene.name = of.at("name");
  scene.body = of.at("body");
  scene.defect = of.at("defect");
  scene.table = of.at("table").at("kind");
  scene.size_px = of.at("size_px");
  scene.frame = of.at("frame");
  scene.rig = rig_of(of);
  const json& pose = of.at("T_camera_body");
  const auto q = pose.at("q_xyzw").get<std::array<double, 4>>();
  scene.probe_body = {Quat{q[0], q[1], q[2], q[3]}.normalized(), vector_of(pose.at("t_m"))};
  for (const json& lamp : of.at("lamps"))
    scene.lamps.push_back({normalized(vector_of(lamp.at("direction"))), lamp.at("azimuth_deg")});
  scene.normals = normals;
  const auto gain = of.at("gain_rgb").get<std::array<double, 3>>();
  // The gains of a sequence differ by the exposure alone: white balance is the same.
  if (scene.frame == 0) first_gain = gain[1];
  scene.exposure_s = gain[1] / first_gain;
  for (const json& one : of.at("irradiance_rgb")) {
    auto& e = scene.irradiance.emplace_back(one.get<std::array<double, 3>>());
    for (std::size_t c = 0; c < 3; ++c) e[c] *= gain[c] / scene.exposure_s;
  }
  scene.scene_class = class_of(of);
  return scene;
}

}  // namespace

const char* to_string(SceneClass scene_class) {
  switch (scene_class) {
    case SceneClass::lit_faces:
      return "lit_faces";
    case SceneClass::shadow_behind:
      return "shadow_behind";
    case SceneClass::other:
      break;
  }
  return "other";
}

Result<std::vector<MarkerScene>> load_marker_scenes(const std::string& folder, const std::string& set) {
  const std::string path = folder + "/" + set + ".jsonl";
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  std::vector<MarkerScene> scenes;
  std::vector<Vec3d> normals;
  std::istringstream lines(*text);
  std::string line;
  double first_gain = 1;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto damaged = [&](const std::string& why) {
      return Status(StatusCode::data_loss, path + ", line " + std::to_string(number) + ": " + why);
    };
    try {
      const json item = json::parse(line);
      if (number == 1) {
        for (const json& n : item.at("normals")) normals.push_back(normalized(vector_of(n)));
        continue;
      }
      scenes.push_back(scene_of(item, normals, first_gain));
    } catch (const json::exception& e) {
      return damaged(e.what());
    }
    const MarkerScene& scene = scenes.back();
    if (scene.lamps.empty() || scene.irradiance.size() != normals.size()) return damaged("lamps or irradiance");
    if (const Status s = scene.rig.validate(); !s.ok()) return damaged(s.message());
  }
  return scenes;
}

SceneScore score(const MarkerScene& scene, const std::optional<Descriptor>& answer) {
  SceneScore out;
  if (!answer) return out;
  out.answered = true;
  out.unsure = answer->flags.has(Flag::unsure);
  double squares = 0, truth = 0;
  for (std::size_t i = 0; i < scene.normals.size(); ++i) {
    const Irradiance e = irradiance_at(*answer, vec_cast<float>(scene.normals[i]));
    const std::array<double, 3> estimate = {e.r, e.g, e.b};
    for (std::size_t c = 0; c < 3; ++c) {
      squares += std::pow(estimate[c] - scene.irradiance[i][c], 2);
      truth += std::pow(scene.irradiance[i][c], 2);
    }
  }
  out.irradiance_rms = std::sqrt(squares / truth);
  if (answer->lights.empty()) return out;

  out.light = true;
  const Vec3d strongest = scene.lamps.front().direction;
  const auto off = [&](const Light& l) { return angle_between(normalized(vec_cast<double>(l.direction)), strongest); };
  const auto first = answer->lights.begin();
  const std::size_t count = std::min(answer->lights.size(), scene.lamps.size());
  const Light& nearest = *std::ranges::min_element(first, first + static_cast<std::ptrdiff_t>(count), {}, off);
  const auto& c = nearest.direction_covariance;
  const DirectionError e =
      direction_error(normalized(vec_cast<double>(nearest.direction)), {c[0], c[1], c[2]}, strongest);
  out.error_deg = e.angle_rad / kDegree;
  out.sigma_deg = e.sigma_rad / kDegree;
  out.mahalanobis2 = e.mahalanobis2;
  out.primary_error_deg = off(answer->lights.front()) / kDegree;
  return out;
}

}  // namespace lightwell::measure
