#include "sim/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>

#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/response.hpp"
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

/// A lens along the probe's -Z whose image circle fills the picture. The focal lengths of `model` are set.
template <class Model>
LensParameters circle_lens(int width, int height, Model model) {
  model.fx = model.fy = 1;
  LensParameters lens{width, height, model, kHalfField, {upright_lens_cv(), {}}, {}};
  const auto rim = CameraModel(lens).project({std::sin(kHalfField), 0, std::cos(kHalfField)});
  model.fx = model.fy = kCircleShare * std::min(width, height) / 2 / (rim ? rim->x : 1);
  model.cx = (width - 1) / 2.0;
  model.cy = (height - 1) / 2.0;
  lens.model = model;
  return lens;
}

constexpr KannalaBrandtParameters kKannalaBrandt{.k1 = -0.018, .k2 = 0.0025, .k3 = -0.0011, .k4 = 0.0001};
constexpr DoubleSphereParameters kDoubleSphere{.xi = -0.2, .alpha = 0.6};

Status check_size(std::string_view kind, int width, int height, PixelFormat format) {
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width < 16 || height < 8) return invalid_argument(size + " is too small for a picture, 16x8 at least");
  if (!size_fits(format, width, height))
    return invalid_argument(size + ": " + std::string(to_string(format)) + " needs even sizes");
  if (kind == "equirect" && width != 2 * height)
    return invalid_argument(size + ": an equirect picture must be twice as wide as high");
  return {};
}

// Cells of the response table; with interpolation the error is below a hundredth of an 8-bit level.
constexpr std::size_t kResponseCells = 4096;
// Electrons above which the Poisson distribution is approximated by a Gaussian: error within 2 % of its sigma.
constexpr double kGaussianElectrons = 50;

std::byte byte_of(double v) { return static_cast<std::byte>(static_cast<int>(std::clamp(v, 0.0, 255.0) + 0.5)); }

// BT.601, limited range, from encoded r, g, b in 0 to 1: the inverse of rgb8_of_ycbcr601().
double luma(const float* p) { return 16 + 65.481 * p[0] + 128.553 * p[1] + 24.966 * p[2]; }
double blue_difference(const std::array<double, 3>& p) { return 128 - 37.797 * p[0] - 74.203 * p[1] + 112 * p[2]; }
double red_difference(const std::array<double, 3>& p) { return 128 + 112 * p[0] - 93.786 * p[1] - 18.214 * p[2]; }

/// Mean of N pixels that share one pair of chroma values.
template <std::size_t N>
std::array<double, 3> mean_of(const std::array<const float*, N>& pixels) {
  std::array<double, 3> mean{};
  for (const float* p : pixels)
    for (std::size_t c = 0; c < 3; ++c) mean[c] += p[c] / static_cast<double>(N);
  return mean;
}

/// Channel of a photosite of the RGGB mosaic: 0 red, 1 green, 2 blue.
std::size_t mosaic_channel(int column, int row) { return static_cast<std::size_t>(column % 2 + row % 2); }

constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15;

std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  return z ^ (z >> 31);
}

/// The centre of one of 2^32 equal cells of [0, 1], which is never 0 or 1.
double unit(std::uint32_t bits) { return (bits + 0.5) / 4294967296.0; }

/// Relative illumination of each pixel; beyond the field of view that of its edge.
std::vector<float> vignetting_of(const LensParameters& lens, const PhotometricCalibration& photometry) {
  std::vector<float> out(static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height), 1.0F);
  if (photometry.vignetting == std::array<double, 3>{}) return out;
  const CameraModel geometry(lens);
  auto at = out.begin();
  for (int j = 0; j < lens.height; ++j) {
    for (int i = 0; i < lens.width; ++i) {
      const auto d = geometry.unproject({static_cast<double>(i), static_cast<double>(j)});
      const double angle = d ? std::atan2(std::hypot(d->x, d->y), d->z) : geometry.max_angle_rad();
      *at++ = static_cast<float>(vignetting(photometry, angle));
    }
  }
  return out;
}

}  // namespace

Result<RigParameters> make_rig(std::string_view kind, int width, int height, PixelFormat format) {
  if (Status size = check_size(kind, width, height, format); !size.ok()) return size;
  RigParameters rig;
  if (kind == "equirect") {
    rig.lenses = {{width, height, EquirectangularParameters{}, std::numbers::pi, {upright_lens_cv(), {}}, {}}};
  } else if (std::ranges::find(kRigKinds, kind) != kRigKinds.end()) {
    const LensParameters front = kind == "double_sphere" ? circle_lens(width, height, kDoubleSphere)
                                                         : circle_lens(width, height, kKannalaBrandt);
    rig.lenses.assign(kind == "single" ? 1 : 2, front);
    // The second lens looks along the probe's +Z, picture upright.
    if (kind != "single")
      rig.lenses[1].pose_cv.rotation = Quat::about({0, 1, 0}, std::numbers::pi) * front.pose_cv.rotation;
  } else {
    const std::string near = nearest_name(kind, {kRigKinds.begin(), kRigKinds.end()});
    return invalid_argument("no rig is called '" + std::string(kind) + "'" +
                            (near.empty() ? "" : ", did you mean '" + near + "'?") + " Known: " + joined(kRigKinds));
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

NoiseStream::NoiseStream(std::uint64_t seed, std::uint64_t frame, int lens)
    : key_(mixed(mixed(mixed(seed + kGolden) + frame + kGolden) + static_cast<std::uint64_t>(lens) + kGolden)) {}

UniformPair NoiseStream::at(std::uint64_t counter) const {
  const std::uint64_t bits = mixed(key_ + (counter + 1) * kGolden);
  return {unit(static_cast<std::uint32_t>(bits >> 32)), unit(static_cast<std::uint32_t>(bits))};
}

double normal_quantile(double p) {
  const double q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * (((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179) /
           (((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0);
  }
  double r = std::sqrt(-std::log(std::min(p, 1 - p)));
  double value = 0;
  if (r <= 5) {
    r -= 1.6;
    value = (((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777) /
            ((0.12021132975 * r + 0.73700164250) * r + 1.0);
  } else {
    r -= 5;
    value = (((0.017337203997 * r + 0.42868294337) * r + 3.0812263860) * r + 6.6579051150) /
            ((0.012258202635 * r + 0.24197894225) * r + 1.0);
  }
  return q < 0 ? -value : value;
}

int poisson_quantile(double mean, double p) {
  double term = std::exp(-mean), sum = term;
  int count = 0;
  // For p near 1, rounding may keep the sum below p; the limit ends the tail, whose terms are negligible.
  while (sum < p && count < 1000) {
    ++count;
    term *= mean / count;
    sum += term;
  }
  return count;
}

/// Computes the rows of one exposure.
class Sensor::RowExposure {
 public:
  RowExposure(const Sensor& sensor, std::span<const float> radiance, const Exposure& exposure)
      : sensor_(sensor),
        photometry_(sensor.model_.photometry),
        radiance_(radiance),
        noise_(sensor.model_.seed, exposure.frame, exposure.lens),
        gain_(exposure.gain) {
    for (std::size_t c = 0; c < 3; ++c) {
      per_radiance_[c] =
          exposure.exposure_s * exposure.gain / (sensor.model_.radiance_per_unit * photometry_.white_balance[c]);
    }
  }

  /// Picture value, 0 to 1, of one channel of one pixel.
  [[nodiscard]] float value(std::size_t pixel, std::size_t channel) const {
    const std::size_t k = 3 * pixel + channel;
    const double x = radiance_[k] * per_radiance_[channel] * sensor_.vignetting_[pixel];
    const double black = photometry_.black_level;
    return response(black + (1 - black) * noisy(x, noise_.at(k)));
  }

  /// Picture values of row j, r, g, b per pixel.
  void row(int j, std::vector<float>& out) const {
    const std::size_t start = static_cast<std::size_t>(j) * static_cast<std::size_t>(sensor_.width_);
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = value(start + k / 3, k % 3);
  }

 private:
  [[nodiscard]] double noisy(double x, UniformPair random) const {
    double seen = x;
    if (photometry_.shot_noise > 0 && x > 0) {
      const double per_electron = gain_ * photometry_.shot_noise;
      const double electrons = x / per_electron;
      seen = electrons < kGaussianElectrons ? per_electron * poisson_quantile(electrons, random.first)
                                            : x + per_electron * std::sqrt(electrons) * normal_quantile(random.first);
    }
    if (photometry_.read_noise > 0) seen += gain_ * photometry_.read_noise * normal_quantile(random.second);
    return seen;
  }

  [[nodiscard]] float response(double linear) const {
    const double at = std::clamp(linear, 0.0, 1.0) * kResponseCells;
    const auto i = std::min(static_cast<std::size_t>(at), kResponseCells - 1);
    const auto share = static_cast<float>(at - static_cast<double>(i));
    return sensor_.response_[i] * (1 - share) + sensor_.response_[i + 1] * share;
  }

  const Sensor& sensor_;
  const PhotometricCalibration& photometry_;
  std::span<const float> radiance_;
  NoiseStream noise_;
  double gain_;
  std::array<double, 3> per_radiance_{};
};

Sensor::Sensor(const LensParameters& lens, const SensorModel& model)
    : model_(model), width_(lens.width), height_(lens.height) {
  if (model_.format == PixelFormat::rgb_f32) return;
  vignetting_ = vignetting_of(lens, model_.photometry);
  response_.resize(kResponseCells + 1);
  for (std::size_t k = 0; k < response_.size(); ++k)
    response_[k] = static_cast<float>(encoded(model_.photometry.response, static_cast<double>(k) / kResponseCells));
}

void Sensor::expose(std::span<const float> radiance, const Exposure& exposure, std::span<std::byte> out) const {
  if (model_.format == PixelFormat::rgb_f32) {
    const auto scale = static_cast<float>(exposure.exposure_s * exposure.gain / model_.radiance_per_unit);
    for (std::size_t k = 0; k < radiance.size(); ++k) {
      const float x = radiance[k] * scale;
      std::memcpy(out.data() + k * sizeof x, &x, sizeof x);
    }
    return;
  }

  const RowExposure pixels(*this, radiance, exposure);
  const auto width = static_cast<std::size_t>(width_);
  if (is_bayer(model_.format)) {
    const PixelLayout& layout = pixel_layout(model_.format);
    const bool bytes = layout.sample_bytes == 1;
    const double top = layout.full_scale();
    for (int j = 0; j < height_; ++j) {
      for (int i = 0; i < width_; ++i) {
        const std::size_t k = static_cast<std::size_t>(j) * width + static_cast<std::size_t>(i);
        const auto word = static_cast<unsigned>(pixels.value(k, mosaic_channel(i, j)) * top + 0.5);
        if (bytes) {
          out[k] = static_cast<std::byte>(word);
          continue;
        }
        out[2 * k] = static_cast<std::byte>(word & 0xFF);
        out[2 * k + 1] = static_cast<std::byte>(word >> 8);
      }
    }
    return;
  }

  std::vector<float> upper(3 * width), lower(3 * width);
  for (int j = 0; j < height_; ++j) {
    std::byte* row = out.data() + stride() * static_cast<std::size_t>(j);
    upper.swap(lower);
    pixels.row(j, lower);
    switch (model_.format) {
      case PixelFormat::rgb8:
        for (std::size_t k = 0; k < 3 * width; ++k) row[k] = byte_of(255.0 * lower[k]);
        break;
      case PixelFormat::yuyv:
        for (std::size_t i = 0; i + 1 < width; i += 2) {
          const float *a = &lower[3 * i], *b = a + 3;
          const std::array<double, 3> mean = mean_of<2>({a, b});
          row[2 * i] = byte_of(luma(a));
          row[2 * i + 1] = byte_of(blue_difference(mean));
          row[2 * i + 2] = byte_of(luma(b));
          row[2 * i + 3] = byte_of(red_difference(mean));
        }
        break;
      case PixelFormat::nv12: {
        for (std::size_t i = 0; i < width; ++i) row[i] = byte_of(luma(&lower[3 * i]));
        if (j % 2 == 0) break;
        std::byte* chroma = out.data() + stride() * static_cast<std::size_t>(height_ + j / 2);
        for (std::size_t i = 0; i + 1 < width; i += 2) {
          const float *a = &upper[3 * i], *b = &lower[3 * i];
          const std::array<double, 3> mean = mean_of<4>({a, a + 3, b, b + 3});
          chroma[i] = byte_of(blue_difference(mean));
          chroma[i + 1] = byte_of(red_difference(mean));
        }
        break;
      }
      case PixelFormat::bayer_rggb8:
      case PixelFormat::bayer_rggb10:
      case PixelFormat::bayer_rggb12:
      case PixelFormat::rgb_f32:
        break;  // Written above.
    }
  }
}

}  // namespace lightwell::sim
