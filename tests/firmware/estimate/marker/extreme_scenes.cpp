#include "firmware/estimate/marker/extreme_scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>

#include <lightwell/codec.hpp>
#include <lightwell/quantile.hpp>

#include "app/tag_body_finder.hpp"
#include "reference/marker/marker_stage.hpp"

namespace lightwell::marker::test {
namespace {

using reference::MarkerScene;
using reference::MarkerStage;

constexpr double kDegree = std::numbers::pi / 180;
/// The 99.73 % quantile of chi square with two degrees of freedom: three sigma of one variable.
constexpr double kThreeSigma = 11.83;
constexpr double kMaxError_deg = 10;
constexpr double kPeakLevel = 0.8;
constexpr std::array<double, 3> kSkin = {0.45, 0.30, 0.22};

MarkerBody body_of(const std::string& folder, const std::string& name) {
  Result<MarkerBody> body = load_marker_body(folder + "/" + name + ".textproto");
  if (!body) throw std::runtime_error(body.status().message());
  return std::move(*body);
}

struct Setting {
  MarkerStage stage;
  double lamp_azimuth_deg = 40, lamp_elevation_deg = 35, lamp_m = 0.61;  ///< lamp_m 0: distant.
  bool table = true;
};

/// A lamp with an irradiance of 1 at the body's centre, in a dim room, and a dark table.
MarkerScene scene_of(const MarkerBody& body, const Setting& setting) {
  MarkerScene scene;
  scene.body = body;
  scene.probe_body = setting.stage.probe_body();
  scene.ambient = reference::even_ambient({0.03, 0.03, 0.03});
  const double azimuth = setting.lamp_azimuth_deg * kDegree, elevation = setting.lamp_elevation_deg * kDegree;
  const double d = setting.lamp_m, power = d * d;
  if (d > 0)
    scene.lamps = {reference::NearLamp{setting.stage.place(azimuth, elevation, d), {power, 0.9 * power, 0.75 * power}}};
  else
    scene.lamps = {reference::DistantLamp{setting.stage.direction(azimuth, elevation), {1, 0.9, 0.75}}};
  // The solids stand on their last face.
  if (setting.table)
    scene.table = reference::table_under(body, scene.probe_body, body.faces.back().tag_id, {0.05, 0.05, 0.05});
  return scene;
}

Pose shown(const MarkerScene& scene, std::size_t face) {
  return compose(scene.probe_body, scene.body.faces[face].body_face);
}

/// A sheet in front of a face and parallel to it, with a rectangular hole; face's frame, m.
std::vector<reference::MarkerOccluder> sheet_with_hole(const Pose& probe_face, double left, double bottom, double right,
                                                       double top) {
  constexpr double kFar = 0.25, kAbove = 0.004;
  const auto rectangle = [&](double x0, double y0, double x1, double y1) -> reference::MarkerOccluder {
    reference::PolygonOccluder out;
    for (const auto& [x, y] : {std::pair{x0, y0}, std::pair{x1, y0}, std::pair{x1, y1}, std::pair{x0, y1}})
      out.corners.push_back(transformed(probe_face, {x, y, kAbove}));
    out.albedo = {0.3, 0.3, 0.3};
    return out;
  };
  return {rectangle(-kFar, -kFar, left, kFar), rectangle(right, -kFar, kFar, kFar),
          rectangle(left, -kFar, right, bottom), rectangle(left, top, right, kFar)};
}

MarkerBody renumbered(MarkerBody body, int first) {
  for (MarkerFace& face : body.faces) face.tag_id += first;
  return body;
}

MarkerBody swapped(MarkerBody body, std::size_t a, std::size_t b) {
  std::swap(body.faces[a].tag_id, body.faces[b].tag_id);
  return body;
}

/// Shifts the tags of each belt of faces by one face: the belts agree with a body rotated by 72 degrees, the top face
/// does not.
MarkerBody belt_rotated(MarkerBody body) {
  const std::vector<MarkerFace> old = body.faces;
  for (std::size_t k = 0; k < 5; ++k) {
    body.faces[1 + k].tag_id = old[1 + (k + 1) % 5].tag_id;
    body.faces[6 + k].tag_id = old[6 + (k + 3) % 5].tag_id;
  }
  return body;
}

void damage(measure::Shot& shot, Harm how, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  for (std::size_t f = 0; f < shot.frames.size(); ++f) {
    std::vector<std::byte>& bytes = shot.pixels[f];
    const View& view = shot.frames[f].views().front();
    if (how == Harm::mirrored) {
      for (int y = 0; y < view.height; ++y) {
        std::byte* const row = bytes.data() + static_cast<std::size_t>(y) * view.stride;
        for (int x = 0; x < view.width / 2; ++x)
          std::swap_ranges(row + 3 * x, row + 3 * x + 3, row + 3 * (view.width - 1 - x));
      }
    } else if (how == Harm::noise_alone) {
      for (std::byte& b : bytes) b = static_cast<std::byte>(random() & 255U);
    } else if (how == Harm::some_not_numbers || how == Harm::all_not_numbers) {
      constexpr std::array<float, 4> kBad = {std::numeric_limits<float>::quiet_NaN(),
                                             std::numeric_limits<float>::infinity(),
                                             -std::numeric_limits<float>::infinity(), -1e30F};
      for (std::size_t at = 0; at + sizeof(float) <= bytes.size(); at += sizeof(float)) {
        const std::uint64_t dice = random();
        if (how == Harm::some_not_numbers && dice % 300 != 0) continue;
        std::memcpy(bytes.data() + at, &kBad[(dice >> 32U) % kBad.size()], sizeof(float));
      }
    }
  }
}

struct TangentOffset {
  double u = 0, v = 0, angle = 0;
};

/// Logarithmic map: the vector from unit vector `from` to `to` along the great circle, in tangent_basis(from), rad.
TangentOffset offset_between(Vec3d from, Vec3d to) {
  const auto [u, v] = tangent_basis(from);
  const double angle = angle_between(from, to), x = dot(to, u), y = dot(to, v), across = std::hypot(x, y);
  return across > 0 ? TangentOffset{x / across * angle, y / across * angle, angle} : TangentOffset{0, 0, angle};
}

/// Describes the first invalid field of a descriptor; empty where all are valid.
std::string find_invalid_field(const Descriptor& d) {
  for (const auto& c : d.radiance.c)
    if (!std::isfinite(c.r) || !std::isfinite(c.g) || !std::isfinite(c.b)) return "radiance is not finite";
  if (!std::isfinite(d.coverage) || !std::isfinite(d.saturated)) return "coverage or saturated is not finite";
  const ErrorBound& b = d.bound;
  for (const float v : {b.total, b.truncation, b.sampling, b.noise, b.quantization, b.smoothing})
    if (std::isnan(v)) return "the bound is NaN";
  for (const Light& l : d.lights) {
    const double length_of = length(vec_cast<double>(l.direction));
    if (!(std::abs(length_of - 1) < 1e-5)) return "a direction is not a unit vector";
    if (!std::isfinite(l.irradiance.r) || !std::isfinite(l.irradiance.g) || !std::isfinite(l.irradiance.b))
      return "an irradiance is not finite";
    const auto& c = l.direction_covariance;
    if (!std::isfinite(c[0]) || !std::isfinite(c[1]) || !std::isfinite(c[2])) return "a covariance is not finite";
    if (!(c[0] > 0 && c[2] > 0 && c[0] * c[2] > c[1] * c[1])) return "a covariance is not positive definite";
    if (l.track == 0) return "a light has no track";
  }
  Descriptor sent = d;
  sent.time.encoded_after = Duration{30'000'000};
  Encoder encoder;
  const auto bytes = encoder.encode(sent);
  if (!bytes) return "the descriptor cannot be encoded: " + bytes.status().message();
  if (const Result<Descriptor> back = decode_descriptor(*bytes); !back)
    return "the encoded descriptor cannot be decoded: " + back.status().message();
  return {};
}

}  // namespace

std::vector<ExtremeCase> extreme_cases(const std::string& folder) {
  const MarkerBody white = body_of(folder, "dodecahedron_100mm_white"), cube = body_of(folder, "cube_60mm_grey");
  // The body is 170 px wide, its tags 40 px.
  const Setting usual{.stage = {.distance_m = 0.45, .elevation_rad = 0.5, .turn_rad = 0.15}};
  const MarkerScene plain = scene_of(white, usual);
  std::vector<ExtremeCase> out;
  // The returned reference is valid until the next call.
  const auto add = [&](const std::string& name, const MarkerScene& scene) -> ExtremeCase& {
    ExtremeCase& one = out.emplace_back();
    one.name = name;
    one.scene = scene;
    return one;
  };

  add("plain", plain).easy = true;
  for (const PixelFormat format : {PixelFormat::nv12, PixelFormat::yuyv, PixelFormat::bayer_rggb8,
                                   PixelFormat::bayer_rggb12, PixelFormat::rgb_f32}) {
    ExtremeCase& one = add("plain, " + std::string(to_string(format)), plain);
    one.format = format;
    one.easy = true;
  }
  {
    ExtremeCase& one = add("bracket of two", plain);
    one.exposures = {0.5, 2};
    one.easy = true;
  }

  // Few visible faces.
  const Setting flat{.stage = {.distance_m = 0.3, .elevation_rad = 0, .turn_rad = 0}, .table = false};
  add("one face, cube seen straight", scene_of(cube, flat));
  Setting distant = flat;
  distant.lamp_m = 0;
  add("one face, distant lamp", scene_of(cube, distant));
  Setting above{.stage = {.distance_m = 0.4, .elevation_rad = std::numbers::pi / 2, .turn_rad = 0.3}};
  add("one face, cube seen from above, its shadow in view", scene_of(cube, above));
  MarkerScene hole = plain;
  hole.occluders = sheet_with_hole(shown(plain, 1), -0.025, -0.025, 0.025, 0.025);
  add("one face, the others covered", hole);

  for (const double elevation : {50.0, 65.0, 80.0}) {
    Setting steep = usual;
    steep.stage.elevation_rad = elevation * kDegree;
    add("camera " + std::to_string(static_cast<int>(elevation)) + " deg above the table", scene_of(white, steep));
  }

  // Light and exposure.
  add("exposure x 2", plain).exposures = {2};
  add("exposure x 4", plain).exposures = {4};
  add("exposure x 50, all saturated", plain).exposures = {50};
  add("exposure x 0.03", plain).exposures = {0.03};
  add("exposure x 1e-4, all black", plain).exposures = {1e-4};
  add("flicker", plain).brightness = {1, 0.5, 0.8, 0.6, 1, 0.55};
  for (const double elevation : {0.0, 4.0}) {
    Setting low = usual;
    low.lamp_elevation_deg = elevation;
    add(elevation > 0 ? "lamp 4 deg above the table's horizon" : "lamp in the table's horizon", scene_of(white, low));
  }
  Setting behind = usual;
  behind.lamp_azimuth_deg = 170;
  add("lamp behind", scene_of(white, behind));
  behind.table = false;
  add("lamp behind, no table", scene_of(white, behind));

  // Occlusions, of a body that is 260 px wide: tags beside the frontal one are read, too.
  Setting nearer = usual;
  nearer.stage.distance_m = 0.3;
  const MarkerScene open = scene_of(white, nearer);
  MarkerScene half = open;
  const Pose front = shown(open, 1);
  half.occluders = {
      reference::PolygonOccluder{{transformed(front, {-0.05, -0.05, 0.005}), transformed(front, {0, -0.05, 0.005}),
                                  transformed(front, {0, 0.05, 0.005}), transformed(front, {-0.05, 0.05, 0.005})},
                                 {0.5, 0.5, 0.5}}};
  add("half of a tag covered", half);
  MarkerScene hand = open;
  const Vec3d body = open.probe_body.translation, right{1, 0, 0}, up{0, 1, 0}, back{0, 0, 1};
  hand.occluders = {reference::SphereOccluder{body + right * 0.045 + back * 0.075, 0.03, kSkin}};
  add("hand before two faces", hand);
  MarkerScene flat_hand = open;
  flat_hand.occluders = {reference::PolygonOccluder{
      {body + right * -0.07 + up * -0.05 + back * 0.08, body + right * -0.005 + up * -0.05 + back * 0.08,
       body + right * -0.005 + up * 0.035 + back * 0.08, body + right * -0.07 + up * 0.035 + back * 0.08},
      kSkin}};
  add("flat hand before the left half", flat_hand);
  const Vec3d to_lamp = reference::lamp_truths(open).front().direction_probe;
  const Vec3d beside = normalized(cross(to_lamp, usual.stage.up()));
  MarkerScene shade = open;
  shade.occluders = {reference::SphereOccluder{body + to_lamp * 0.2 + beside * 0.02, 0.009, kSkin}};
  add("a hand's shadow on a part of the body", shade);
  shade.occluders = {reference::PolygonOccluder{{body + to_lamp * 0.3 + beside * 0.002 + usual.stage.up() * -0.2,
                                                 body + to_lamp * 0.3 + beside * 0.2 + usual.stage.up() * -0.2,
                                                 body + to_lamp * 0.3 + beside * 0.2 + usual.stage.up() * 0.2,
                                                 body + to_lamp * 0.3 + beside * 0.002 + usual.stage.up() * 0.2},
                                                kSkin}};
  add("a sheet's shadow on half of the body", shade);
  shade.occluders = {reference::SphereOccluder{body + to_lamp * 0.3, 0.1, kSkin}};
  add("all of the body in a shadow", shade);

  // Assumptions that are wrong.
  add("mirrored picture", plain).harm = Harm::mirrored;
  add("another body's tags", plain).believed_body = renumbered(white, 100);
  add("two tags swapped in the body file", plain).believed_body = swapped(white, 1, 2);
  add("rings turned in the body file", plain).believed_body = belt_rotated(white);
  {
    ExtremeCase& one = add("another body with the same tags", plain);
    one.believed_body = body_of(folder, "icosahedron_100mm_white");
  }
  add("noise alone", plain).harm = Harm::noise_alone;
  for (const bool all : {false, true}) {
    ExtremeCase& one = add(all ? "floats, none a number" : "floats, one of a hundred pixels not a number", plain);
    one.format = PixelFormat::rgb_f32;
    one.harm = all ? Harm::all_not_numbers : Harm::some_not_numbers;
  }
  add("focal length 2 % too long", plain).believed_focal = 1.02;
  add("focal length 2 % too short", plain).believed_focal = 0.98;

  // Size and blur.
  Setting far = usual;
  far.stage.distance_m = 700 * 0.11 / 20;
  add("20 px wide", scene_of(white, far));
  far.stage.distance_m = 700 * 0.11 / 60;
  add("60 px wide", scene_of(white, far));
  Setting close = usual;
  close.stage.distance_m = 0.22;
  ExtremeCase& large = add("900 px wide", scene_of(white, close));
  large.width = 1280, large.height = 960, large.focal_px = 1700;
  large.easy = true;
  ExtremeCase blurred = large;
  add("blur of 3 px", plain).blur_px = 3;
  add("blur of 10 px", plain).blur_px = 10;
  blurred.name = "900 px wide, blur of 10 px";
  blurred.blur_px = 10;
  blurred.easy = false;
  out.push_back(blurred);
  return out;
}

const char* name_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::refused:
      return "refused";
    case Outcome::flagged:
      return "flagged";
    case Outcome::right:
      return "right";
    case Outcome::wrong:
      return "wrong";
  }
  return "unknown";
}

ExtremePicture::ExtremePicture(ExtremeCase what) : case_(std::move(what)) {
  const LensParameters lens = reference::pinhole_lens(case_.width, case_.height, case_.focal_px);
  reference::RenderOptions options;
  options.samples = 2;
  options.edge_rays = 34;
  options.blur_px = case_.blur_px;
  radiance_.push_back(reference::render(case_.scene, reference::MarkerCamera(lens), options).rgb);
  // Exposes for the 99.9 % quantile: overshoot at edges does not determine the exposure.
  std::vector<float> values = radiance_.front();
  exposure_ = kPeakLevel / std::max(1e-9, order_statistic(values, values.size() - 1 - values.size() / 1000));
  rig_.lenses.push_back(lens);
  PhotometricCalibration& p = rig_.lenses.front().photometry;
  p.response.kind = is_bayer(case_.format) || case_.format == PixelFormat::rgb_f32 ? ResponseCurve::Kind::linear
                                                                                   : ResponseCurve::Kind::srgb;
  p.read_noise = 0.002;
  p.shot_noise = 1e-4;
  truth_ = reference::lamp_truths(case_.scene).front().direction_probe;
}

std::vector<Evaluation> ExtremePicture::evaluate_frames(std::uint64_t seed) const {
  RigParameters believed = rig_;
  auto& model = std::get<MeiParameters>(believed.lenses.front().model);
  model.fx *= case_.believed_focal, model.fy *= case_.believed_focal;
  const MarkerBody& body = case_.believed_body ? *case_.believed_body : case_.scene.body;
  const auto stop = [](const Status& s) {
    Evaluation v;
    v.outcome = Outcome::wrong;
    v.why = "the finder or the estimator was not created: " + s.message();
    return std::vector{v};
  };
  Result<std::unique_ptr<BodyFinder>> finder = make_tag_body_finder(believed, body);
  if (!finder) return stop(finder.status());
  auto estimator = make_marker_estimator(believed, body, std::move(*finder), {});
  if (!estimator) return stop(estimator.status());

  const measure::Camera camera(rig_, case_.format);
  std::vector<Evaluation> out;
  for (std::size_t i = 0; i < case_.brightness.size(); ++i) {
    std::vector<double> exposures;
    for (const double e : case_.exposures) exposures.push_back(e * exposure_ * case_.brightness[i]);
    measure::Shot shot = camera.expose(radiance_, exposures, 1000 * seed + i);
    for (std::size_t k = 0; k < shot.frames.size(); ++k) shot.frames[k].info.exposure_s = case_.exposures[k];
    damage(shot, case_.harm, seed);
    Descriptor made;
    const Status status = (*estimator)->estimate(shot.frames, made);
    out.push_back(evaluate_extreme(status, made, truth_));
    if (!status.ok()) continue;
    out.back().descriptor = std::move(made);
    out.back().report = (*estimator)->report();
  }
  return out;
}

Evaluation ExtremePicture::worst(std::uint64_t seed) const {
  const std::vector<Evaluation> all = evaluate_frames(seed);
  return *std::max_element(all.begin(), all.end(), [](const Evaluation& a, const Evaluation& b) {
    return std::pair(a.outcome, a.error_deg) < std::pair(b.outcome, b.error_deg);
  });
}

Evaluation evaluate_extreme(const Status& status, const Descriptor& made, Vec3d truth) {
  Evaluation out;
  if (!status.ok()) {
    out.why = status.message();
    const bool known = status.code() == StatusCode::not_found || status.code() == StatusCode::invalid_argument;
    out.outcome = known && !out.why.empty() ? Outcome::refused : Outcome::wrong;
    return out;
  }
  bool near_enough = false;
  if (!made.lights.empty()) {
    const Light& strongest = made.lights.front();
    out.direction = vec_cast<double>(strongest.direction);
    const TangentOffset t = offset_between(*out.direction, truth);
    const auto& c = strongest.direction_covariance;
    const double det = static_cast<double>(c[0]) * c[2] - static_cast<double>(c[1]) * c[1];
    out.error_deg = t.angle / kDegree;
    out.squared_mahalanobis = (c[2] * t.u * t.u - 2 * c[1] * t.u * t.v + c[0] * t.v * t.v) / det;
    out.sigma_deg =
        t.angle > 0 ? std::sqrt(c[0] * t.u * t.u + 2 * c[1] * t.u * t.v + c[2] * t.v * t.v) / t.angle / kDegree : 0;
    near_enough = out.squared_mahalanobis < kThreeSigma;
  }
  out.why = find_invalid_field(made);
  if (!out.why.empty()) {
    out.outcome = Outcome::wrong;
    return out;
  }
  for (const Flag flag : {Flag::unsure, Flag::dark, Flag::clipped, Flag::cleaned})
    if (made.flags.has(flag)) out.why += (out.why.empty() ? "" : " ") + std::string(to_string(flag));
  const bool unsure = made.flags.has(Flag::unsure) || made.flags.has(Flag::dark);
  if (unsure || (made.flags.has(Flag::clipped) && near_enough)) {
    out.outcome = Outcome::flagged;
  } else if (near_enough && out.error_deg <= kMaxError_deg) {
    out.outcome = Outcome::right;
  } else {
    out.outcome = Outcome::wrong;
    out.why += (out.why.empty() ? "" : ", ") + std::string(made.lights.empty() ? "no light, and no flag"
                                                           : near_enough       ? "far off"
                                                                               : "beyond three sigma");
  }
  return out;
}

}  // namespace lightwell::marker::test
