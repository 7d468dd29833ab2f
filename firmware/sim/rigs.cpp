#include "sim/rigs.hpp"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>

#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/response.hpp"
#include "imaging/pixel_layout.hpp"
#include "imaging/uri.hpp"

namespace lightwell::sim {

namespace {

constexpr double kHalfField = 95.0 / 180.0 * std::numbers::pi;
constexpr double kCircleShare = 0.99;
// Radiance units: radiance 1 gives full scale in 10 ms at gain 1.
constexpr double kRadiancePerUnit = 0.01;
constexpr double kFullWellElectrons = 10000, kReadElectrons = 3;

PhotometricCalibration photometry_of(PixelFormat format) {
  PhotometricCalibration p;
  const PixelLayout& layout = pixel_layout(format);
  if (layout.is_float()) return p;
  p.vignetting = {-0.08, 0.005, 0};
  p.shot_noise = 1 / kFullWellElectrons;
  p.read_noise = kReadElectrons / kFullWellElectrons;
  p.response.kind = ResponseCurve::Kind::srgb;
  if (is_bayer(format)) {
    p.response.kind = ResponseCurve::Kind::linear;
    // Code 16 of 8 bits, 64 of 10 bits, 256 of 12 bits.
    p.black_level = layout.levels() / 16.0 / layout.full_scale();
  }
  return p;
}

/// A lens along the probe's -Z whose image circle fills the picture. `model` has focal lengths of 1 px, which are
/// scaled.
template <class Model>
LensParameters circle_lens(int width, int height, Model model) {
  LensParameters lens;
  lens.width = width;
  lens.height = height;
  lens.max_angle_rad = kHalfField;
  lens.pose_cv.rotation = upright_lens_cv();
  model.fx = model.fy = 1;
  lens.model = model;
  const auto rim = CameraModel(lens).project({std::sin(kHalfField), 0, std::cos(kHalfField)});
  model.fx = model.fy = kCircleShare * std::min(width, height) / 2 / (rim ? rim->x : 1);
  model.cx = (width - 1) / 2.0;
  model.cy = (height - 1) / 2.0;
  lens.model = model;
  return lens;
}

LensParameters kannala_brandt_lens(int width, int height) {
  KannalaBrandtParameters model;
  model.k1 = -0.018;
  model.k2 = 0.0025;
  model.k3 = -0.0011;
  model.k4 = 0.0001;
  return circle_lens(width, height, model);
}

LensParameters double_sphere_lens(int width, int height) {
  DoubleSphereParameters model;
  model.xi = -0.2;
  model.alpha = 0.6;
  return circle_lens(width, height, model);
}

LensParameters equirect_lens(int width, int height) {
  LensParameters lens;
  lens.width = width;
  lens.height = height;
  lens.model = EquirectangularParameters{};
  lens.max_angle_rad = std::numbers::pi;
  lens.pose_cv.rotation = upright_lens_cv();
  return lens;
}

/// The same lens along the probe's +Z, picture upright.
LensParameters rear_lens(LensParameters lens) {
  lens.pose_cv.rotation = Quat::about({0, 1, 0}, std::numbers::pi) * lens.pose_cv.rotation;
  return lens;
}

Status check_size(std::string_view kind, int width, int height, PixelFormat format) {
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width < 16 || height < 8)
    return {StatusCode::invalid_argument, size + " is too small for a picture, 16x8 at least"};
  if (!size_fits(format, width, height))
    return {StatusCode::invalid_argument, size + ": " + std::string(to_string(format)) + " needs even sizes"};
  if (kind == "equirect" && width != 2 * height)
    return {StatusCode::invalid_argument, size + ": an equirect picture must be twice as wide as high"};
  return {};
}

}  // namespace

Result<RigParameters> make_rig(std::string_view kind, int width, int height, PixelFormat format) {
  if (Status size = check_size(kind, width, height, format); !size.ok()) return size;
  RigParameters rig;
  if (kind == "equirect") {
    rig.lenses = {equirect_lens(width, height)};
  } else if (std::ranges::find(kRigKinds, kind) != kRigKinds.end()) {
    rig.lenses = {kind == "double_sphere" ? double_sphere_lens(width, height) : kannala_brandt_lens(width, height)};
    if (kind != "single") rig.lenses.push_back(rear_lens(rig.lenses[0]));
  } else {
    const std::string near = nearest_name(kind, {kRigKinds.begin(), kRigKinds.end()});
    return Status(StatusCode::invalid_argument, "no rig is called '" + std::string(kind) + "'" +
                                                    (near.empty() ? "" : ", did you mean '" + near + "'?") +
                                                    " Known: " + joined(kRigKinds));
  }
  for (LensParameters& lens : rig.lenses) {
    lens.photometry = photometry_of(format);
    // An equirectangular picture has no optical axis, hence no vignetting.
    if (kind == "equirect") lens.photometry.vignetting = {};
  }
  if (format != PixelFormat::rgb_f32) rig.nits_per_unit = kRadiancePerUnit;
  return rig;
}

SensorModel sensor_of(const RigParameters& rig, PixelFormat format, std::uint64_t seed) {
  SensorModel sensor;
  sensor.format = format;
  sensor.photometry = rig.lenses.front().photometry;
  sensor.radiance_per_unit = rig.nits_per_unit > 0 ? rig.nits_per_unit : 1;
  sensor.seed = seed;
  return sensor;
}

double exposure_below_saturation(const SensorModel& sensor, double radiance, double gain) {
  if (sensor.format == PixelFormat::rgb_f32 || !(radiance > 0)) return 1;
  const PhotometricCalibration& p = sensor.photometry;
  const double saturated = (linearized(p.response, p.saturation) - p.black_level) / (1 - p.black_level);
  return 0.95 * saturated * sensor.radiance_per_unit / (radiance * gain);
}

}  // namespace lightwell::sim
