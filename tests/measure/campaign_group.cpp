#include "measure/campaign_group.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "calibration/model/camera_model.hpp"
#include "sim/sensor.hpp"

namespace lightwell::measure {
namespace {

using extremes::Chance;

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kFrameRate = 30;
/// The first frames of a group have no change, the later ones up to kMaxChanges.
constexpr int kFirstChange = 4, kMaxChanges = 3;
/// A lamp that is carried moves for so many frames, a light that fades changes for so many.
constexpr int kCarryFrames = 6, kFadeFrames = 10;

constexpr SensorChoice kSensors[] = {
    {"rgb_f32", PixelFormat::rgb_f32, ResponseCurve::Kind::linear},
    {"rgb8_linear", PixelFormat::rgb8, ResponseCurve::Kind::linear},
    {"rgb8", PixelFormat::rgb8, ResponseCurve::Kind::srgb},
    {"nv12", PixelFormat::nv12, ResponseCurve::Kind::srgb},
    {"yuyv", PixelFormat::yuyv, ResponseCurve::Kind::srgb},
    {"bayer8", PixelFormat::bayer_rggb8, ResponseCurve::Kind::linear},
    {"bayer12", PixelFormat::bayer_rggb12, ResponseCurve::Kind::linear},
};

/// One of the values, each as probable as the numbers beside it.
template <class T, std::size_t N>
T one_of(Chance& chance, const std::pair<T, int> (&choices)[N]) {
  int sum = 0;
  for (const auto& [value, weight] : choices) sum += weight;
  int at = chance.below(sum);
  for (const auto& [value, weight] : choices) {
    if (at < weight) return value;
    at -= weight;
  }
  return choices[N - 1].first;
}

EstimatorConfig draw_config(Chance& chance) {
  EstimatorConfig config;
  config.setting = kSettings[static_cast<std::size_t>(chance.below(4))];
  config.panorama.interleave = one_of<int>(chance, {{1, 4}, {2, 1}, {4, 1}, {8, 1}, {16, 1}});
  config.panorama.max_bytes = one_of<int>(chance, {{0, 4}, {96, 1}, {128, 1}, {192, 1}, {256, 1}});
  config.panorama.smoothing = one_of<Smoothing>(chance, {{Smoothing::one_euro, 2}, {Smoothing::none, 1}});
  return config;
}

void draw_exposure(Chance& chance, SceneKind kind, Group& out) {
  out.exposures = out.sensor.format == PixelFormat::rgb_f32 ? 1 : 1 + 2 * chance.below(2);
  if (out.sensor.format == PixelFormat::rgb_f32) return;
  out.exposure =
      one_of<ExposureKind>(chance, {{ExposureKind::right, 3}, {ExposureKind::over, 1}, {ExposureKind::under, 1}});
  if (kind == SceneKind::dark) out.exposure = ExposureKind::under;
  if (out.exposure == ExposureKind::over) out.exposure_factor = chance.magnitude(1.1, 10);
  if (out.exposure == ExposureKind::under)
    out.exposure_factor = 1 / (kind == SceneKind::dark ? chance.magnitude(10, 3000) : chance.magnitude(1.1, 8));
}

/// The axis of a lamp that moves by this angle to any side.
Vec3d moved(Chance& chance, Vec3d axis, double angle_rad) {
  const std::array<Vec3d, 2> tangents = tangent_basis(axis);
  const double side = chance.between(0, 2 * std::numbers::pi);
  const Vec3d toward = tangents[0] * std::cos(side) + tangents[1] * std::sin(side);
  return normalized(axis * std::cos(angle_rad) + toward * std::sin(angle_rad));
}

/// Changes of light from frame `first` on. Later ones override it where they concern the same lamp.
void add_change(Chance& chance, const CampaignScene& scene, int first, std::vector<GroupFrame>& frames) {
  enum class Change { switched, dimmed, jumped, carried, all_switched, faded };
  const auto change = one_of<Change>(chance, {{Change::switched, 3},
                                              {Change::dimmed, 1},
                                              {Change::jumped, 2},
                                              {Change::carried, 2},
                                              {Change::all_switched, 1},
                                              {Change::faded, 2}});
  const auto count = static_cast<int>(scene.first_state().lamps.size());
  const auto lamp = static_cast<std::size_t>(chance.below(count));
  const double factor = chance.magnitude(0.1, 3), angle = chance.magnitude(0.3, 60) * kDeg;
  const double step = chance.magnitude(0.05, 3) * kDeg, fade = chance.magnitude(0.3, 3);
  Vec3d axis = frames[static_cast<std::size_t>(first)].light.lamps[lamp].axis;
  const Vec3d target = moved(chance, axis, kCarryFrames * step), jump = moved(chance, axis, angle);
  for (int i = first; i < kGroupFrames; ++i) {
    GroupFrame& frame = frames[static_cast<std::size_t>(i)];
    LampState& at = frame.light.lamps[lamp];
    switch (change) {
      case Change::switched:
        at.factor = at.factor > 0 ? 0 : 1;
        break;
      case Change::dimmed:
        at.factor *= factor;
        break;
      case Change::jumped:
        if (scene.movable(lamp)) at.axis = jump;
        break;
      case Change::carried: {
        const double share = std::min(1.0, (i - first + 1.0) / kCarryFrames);
        if (scene.movable(lamp)) at.axis = normalized(axis * (1 - share) + target * share);
        break;
      }
      case Change::all_switched:
        for (LampState& any : frame.light.lamps) any.factor = any.factor > 0 ? 0 : 1;
        break;
      case Change::faded:
        frame.light.gain *= std::pow(fade, std::min(1.0, (i - first + 1.0) / kFadeFrames));
        break;
    }
  }
}

std::vector<GroupFrame> draw_frames(Chance& chance, const CampaignScene& scene, double turn_deg_per_s) {
  const double yaw = chance.between(0, 2 * std::numbers::pi);
  std::vector<GroupFrame> frames;
  for (int i = 0; i < kGroupFrames; ++i)
    frames.push_back({scene.first_state(), yaw + i * turn_deg_per_s * kDeg / kFrameRate});
  for (int k = chance.below(kMaxChanges + 1); k > 0; --k)
    add_change(chance, scene, kFirstChange + chance.below(kGroupFrames - kFirstChange), frames);
  for (std::size_t i = 1; i < frames.size(); ++i)
    frames[i].lamps_changed = frames[i].light.lamps != frames[i - 1].light.lamps;
  return frames;
}

/// The lenses of a pair with the camera model of Mei & Rives, of the same field of view and image circle.
void use_mei(RigParameters& rig) {
  for (LensParameters& lens : rig.lenses) {
    MeiParameters mei{.fx = 1, .fy = 1, .xi = 1.4, .k1 = -0.02, .k2 = 0.004, .p1 = 0, .p2 = 0};
    LensParameters unit = lens;
    unit.model = mei;
    const double edge = lens.max_angle_rad;
    const auto rim = CameraModel(unit).project({std::sin(edge), 0, std::cos(edge)});
    constexpr double kCircleShare = 0.99;
    mei.fx = mei.fy = kCircleShare * std::min(lens.width, lens.height) / 2 / (rim ? rim->x : 1);
    mei.cx = (lens.width - 1) / 2.0;
    mei.cy = (lens.height - 1) / 2.0;
    lens.model = mei;
  }
}

}  // namespace

std::string_view to_string(ExposureKind kind) {
  constexpr std::string_view kNames[] = {"right", "over", "under"};
  return kNames[static_cast<std::size_t>(kind)];
}

RigParameters Group::rig() const {
  const std::string_view kind = lens == "mei" ? "pair" : lens;
  RigParameters rig = *sim::make_rig(kind, width, height, sensor.format);
  if (lens == "mei") use_mei(rig);
  for (LensParameters& each : rig.lenses) each.photometry.response.kind = sensor.response;
  return rig;
}

int Group::rotation_length() const {
  if (sensor.format == PixelFormat::rgb_f32) return 1;
  return config.setting == Setting::fastest ? kMaxInterleave : config.panorama.interleave;
}

Result<Group> draw_group(std::uint32_t number) {
  Chance chance(number);
  Group out;
  out.number = number;
  const SceneKind kind =
      chance.below(5) < 2 ? SceneKind::real : kSceneKinds[static_cast<std::size_t>(1 + chance.below(8))];
  Result<CampaignScene> scene = CampaignScene::draw(kind, chance);
  if (!scene) return scene.status();
  out.scene = std::move(*scene);
  out.lens = one_of<std::string_view>(
      chance, {{"pair", 16}, {"double_sphere", 5}, {"mei", 4}, {"equirect", 13}, {"single", 2}});
  const int size = one_of<int>(chance, {{0, 36}, {1, 3}, {2, 1}});
  constexpr std::array<int, 3> kWidths{320, 480, 640};
  out.width = kWidths[static_cast<std::size_t>(size)];
  out.height = out.lens == "equirect" ? out.width / 2 : out.width * 3 / 4;
  // Floats twice: the only ideal sensor.
  out.sensor =
      kSensors[static_cast<std::size_t>(std::max(0, chance.below(1 + static_cast<int>(std::size(kSensors))) - 1))];
  draw_exposure(chance, kind, out);
  out.config = draw_config(chance);
  out.tilt = chance.rotation();
  if (chance.below(2) == 0) out.turn_deg_per_s = (chance.below(2) == 0 ? 1 : -1) * chance.magnitude(1, 120);
  out.frames = draw_frames(chance, out.scene, out.turn_deg_per_s);
  return out;
}

}  // namespace lightwell::measure
