#include "measure/three_balls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <lightwell/quantile.hpp>

namespace lightwell::measure {

namespace ref = reference;

namespace {

constexpr double kAlbedo = 0.8;
constexpr double kWhitePercentile = 0.999;
constexpr int kProtocolWidth = 256, kProtocolHeight = 128;
constexpr double kProtocolGamma = 2.4, kProtocolMedian = 0.5;

/// Area resampling: each target pixel is the mean over the source area that it covers, including parts of pixels.
ref::Panorama resized(const ref::Panorama& p, int width, int height) {
  if (p.width == width && p.height == height) return p;
  ref::Panorama out{width, height,
                    std::vector<double>(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
  const auto overlap = [](int source, double from, double to) {
    return std::max(0.0, std::min(source + 1.0, to) - std::max(static_cast<double>(source), from));
  };
  for (int j = 0; j < height; ++j) {
    const double top = static_cast<double>(j) * p.height / height,
                 bottom = static_cast<double>(j + 1) * p.height / height;
    for (int i = 0; i < width; ++i) {
      const double left = static_cast<double>(i) * p.width / width,
                   right = static_cast<double>(i + 1) * p.width / width;
      ref::Rgb sum{};
      for (int b = static_cast<int>(top); b < p.height && b < bottom; ++b) {
        for (int a = static_cast<int>(left); a < p.width && a < right; ++a) {
          const double share = overlap(a, left, right) * overlap(b, top, bottom) / ((right - left) * (bottom - top));
          const ref::Rgb value = ref::pixel(p, a, b);
          for (std::size_t c = 0; c < 3; ++c) sum[c] += share * value[c];
        }
      }
      ref::set_pixel(out, i, j, sum);
    }
  }
  return out;
}

/// The median of the positive values; 0 if there are none.
double median_of_positive(const std::vector<double>& values) {
  std::vector<double> positive;
  std::copy_if(values.begin(), values.end(), std::back_inserter(positive), [](double v) { return v > 0; });
  if (positive.empty()) return 0;
  std::sort(positive.begin(), positive.end());
  const std::size_t n = positive.size();
  return 0.5 * (positive[(n - 1) / 2] + positive[n / 2]);
}

double factor_for(double median) { return median > 0 ? kProtocolMedian / median : 1; }

ref::Rgb scaled(double factor, const ref::Rgb& c) { return {factor * c[0], factor * c[1], factor * c[2]}; }

double product(const ref::Rgb& a, const ref::Rgb& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace

std::string_view ball_name(Ball ball) {
  constexpr std::array<std::string_view, kBalls.size()> names = {"diffuse", "matte silver", "mirror", "mirror 0.25",
                                                                 "mirror 0.5"};
  return names[static_cast<std::size_t>(ball)];
}

double ball_roughness(Ball ball) {
  constexpr std::array<double, kBalls.size()> roughness = {1, 0.3271, 0, 0.25, 0.5};
  return roughness[static_cast<std::size_t>(ball)];
}

BallView::BallView(int view_size, const ref::V3& towards_viewer) : size(view_size) {
  const ref::V3 v = ref::normalised(towards_viewer);
  const ref::V3 right = ref::normalised(ref::cross({0, 1, 0}, v));
  const ref::V3 up = ref::cross(v, right);
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i < size; ++i) {
      const double x = 2 * (i + 0.5) / size - 1, y = 1 - 2 * (j + 0.5) / size;
      const double depth2 = 1 - x * x - y * y;
      if (depth2 < 0) continue;
      const ref::V3 n = ref::normalised(x * right + y * up + std::sqrt(depth2) * v);
      pixels.push_back(static_cast<std::size_t>(j) * static_cast<std::size_t>(size) + static_cast<std::size_t>(i));
      normals.push_back(n);
      reflections.push_back(ref::normalised(2 * ref::dot(n, v) * n - v));
    }
  }
}

BallPictures ball_pictures(const BallView& view, const IrradianceAnswer& irradiance, const RadianceAnswer& radiance) {
  BallPictures pictures;
  for (const Ball ball : kBalls) {
    BallPicture& picture = pictures[static_cast<std::size_t>(ball)];
    picture.reserve(view.pixels.size());
    for (std::size_t k = 0; k < view.pixels.size(); ++k) {
      picture.push_back(ball == Ball::diffuse ? scaled(kAlbedo / ref::pi, irradiance(view.normals[k]))
                                              : scaled(kAlbedo, radiance(view.reflections[k], ball_roughness(ball))));
    }
  }
  return pictures;
}

BallPictures ball_pictures(const BallView& view, const PanoramaSums& sums) {
  return ball_pictures(
      view, [&](const ref::V3& n) { return sums.irradiance(n); },
      [&](const ref::V3& d, double roughness) { return sums.radiance(d, roughness); });
}

BallError ball_error(const BallPicture& truth, const BallPicture& answer, double exposure) {
  BallError error;
  if (truth.empty()) return error;
  double difference = 0, tt = 0, ta = 0, aa = 0, degrees = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const ref::Rgb &t = truth[k], &a = answer.at(k);
    for (std::size_t c = 0; c < 3; ++c) difference += (a[c] - t[c]) * (a[c] - t[c]);
    const double lengths = std::sqrt(product(t, t) * product(a, a));
    if (lengths > 0) degrees += std::acos(std::clamp(product(t, a) / lengths, 0.0, 1.0)) * 180 / ref::pi;
    tt += product(t, t);
    ta += product(t, a);
    aa += product(a, a);
  }
  const auto pixels = static_cast<double>(truth.size());
  error.rmse = exposure * std::sqrt(difference / pixels);
  // Least over s of |t - s a|^2: s = ta / aa.
  error.si_rmse = exposure * std::sqrt(std::max(0.0, aa > 0 ? tt - ta * ta / aa : tt) / pixels);
  error.angular_deg = degrees / pixels;
  error.truth_rms = exposure * std::sqrt(tt / pixels);
  return error;
}

double clipped_si_rmse(const BallPicture& truth, const BallPicture& answer) {
  std::vector<double> values;
  for (const ref::Rgb& v : truth) values.insert(values.end(), v.begin(), v.end());
  const double white = lower_quantile(values, kWhitePercentile);
  if (!(white > 0)) return std::numeric_limits<double>::quiet_NaN();
  const auto clipped = [white](BallPicture picture) {
    for (ref::Rgb& v : picture)
      for (double& c : v) c = std::clamp(c / white, 0.0, 1.0);
    return picture;
  };
  return ball_error(clipped(truth), clipped(answer), 1).si_rmse;
}

double exposure(const ref::Panorama& panorama) {
  return factor_for(median_of_positive(resized(panorama, kProtocolWidth, kProtocolHeight).rgb));
}

ref::Panorama published_environment(const ref::Panorama& panorama) {
  ref::Panorama p = resized(panorama, kProtocolWidth, kProtocolHeight);
  for (double& value : p.rgb) value = std::pow(std::max(0.0, value), 1 / kProtocolGamma);
  const double factor = factor_for(median_of_positive(p.rgb));
  for (double& value : p.rgb) value *= factor;
  return p;
}

ref::Panorama answer_environment(const std::function<ref::Rgb(const ref::V3&)>& radiance,
                                 std::span<const CapLight> lights) {
  ref::Panorama p = ref::cleaned(ref::from_function(kProtocolWidth, kProtocolHeight, radiance, 2));
  for (const CapLight& light : lights) {
    const double radius = std::max(light.angular_radius_rad, 0.5 * ref::pi / kProtocolHeight);
    const double sine = std::sin(std::min(radius, 0.5 * ref::pi));
    p = ref::sum(p, ref::disc_lamp(kProtocolWidth, kProtocolHeight, light.direction, radius,
                                   scaled(1 / (ref::pi * sine * sine), light.vector_irradiance)));
  }
  return p;
}

}  // namespace lightwell::measure
