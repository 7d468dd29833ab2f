#include "measure/specular_light_errors.hpp"

#include <algorithm>
#include <memory>
#include <numbers>
#include <span>

#include <lightwell/lighting.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "estimate/specular/environment_picture.hpp"
#include "measure/panorama_sums.hpp"
#include "tools/command_line.hpp"

namespace lightwell::measure {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

reference::Rgb rgb(const auto& v) {
  return {static_cast<double>(v.r), static_cast<double>(v.g), static_cast<double>(v.b)};
}

/// Light with a cap for each listed one.
reference::Panorama answer_of(const Descriptor& d) {
  const Lighting light = Lighting::of(d);
  std::vector<CapLight> caps;
  for (const Light& l : d.lights)
    caps.push_back({in_world(d, l.direction), static_cast<double>(l.angular_radius_rad), rgb(l.irradiance)});
  return answer_environment([&](const reference::V3& w) { return rgb(light.radiance(in_probe(d, w), 0).value); }, caps);
}

/// `truth` and `blurred` by the lobe.
std::array<BallErrors, kComparedBalls.size()> ball_errors(const reference::Panorama& truth,
                                                          const reference::Panorama& answer,
                                                          const reference::Panorama& blurred) {
  const BallView view(64);
  const double of_truth = exposure(truth);
  const auto published = [&](const reference::Panorama& p) {
    return ball_pictures(view, PanoramaSums(published_environment(p)));
  };
  const BallPictures t = ball_pictures(view, PanoramaSums(truth)), a = ball_pictures(view, PanoramaSums(answer)),
                     tp = published(truth), ap = published(answer), bp = published(blurred);
  std::array<BallErrors, kComparedBalls.size()> out;
  for (std::size_t n = 0; n < kComparedBalls.size(); ++n) {
    const Ball ball = kComparedBalls[n];
    // Only the pixels whose normal (reflection) is in the part that the plane can mirror.
    std::vector<std::size_t> used;
    for (std::size_t k = 0; k < view.normals.size(); ++k)
      if ((ball == Ball::diffuse ? view.normals : view.reflections)[k].y > kLowestMirrored) used.push_back(k);
    const auto part = [&](const BallPictures& pictures) {
      BallPicture picture;
      for (const std::size_t k : used) picture.push_back(pictures[static_cast<std::size_t>(ball)][k]);
      return picture;
    };
    out[n] = {ball_error(part(t), part(a), of_truth), ball_error(part(tp), part(ap), 1),
              ball_error(part(tp), part(bp), 1)};
  }
  return out;
}

}  // namespace

const Light* nearest_light(const Descriptor& d, const reference::V3& world) {
  const Light* out = nullptr;
  double best = -2;
  for (const Light& l : d.lights)
    if (const double cosine = reference::dot(in_world(d, l.direction), world); cosine > best) best = cosine, out = &l;
  return out;
}

Descriptor described(const reference::Panorama& environment) {
  using specular::EnvironmentPicture;
  PanoramaOptions options;
  options.config.panorama.smoothing = Smoothing::none;
  options.config.panorama.epsilon = 0;
  const std::unique_ptr<Estimator> estimator = require(make_panorama_estimator(EnvironmentPicture::rig(), options));
  std::vector<float> pixels;
  for (int j = 0; j < EnvironmentPicture::kHeight; ++j)
    for (int i = 0; i < EnvironmentPicture::kWidth; ++i) {
      const reference::V3 d = reference::pixel_direction(i, j, EnvironmentPicture::kWidth, EnvironmentPicture::kHeight);
      for (const double v : reference::sample(environment, d)) pixels.push_back(static_cast<float>(v));
    }
  Frame frame;
  frame.info.exposure_s = 1;
  frame.add_view({0, PixelFormat::rgb_f32, EnvironmentPicture::kWidth, EnvironmentPicture::kHeight,
                  EnvironmentPicture::kWidth * 3 * sizeof(float), std::as_bytes(std::span(pixels))});
  Descriptor out;
  require(estimator->estimate({&frame, 1}, out));
  // The picture's axes are the world's: the plane's +Z is its +Y.
  out.T_probe_origin.rotation = Quat::about({1, 0, 0}, -std::numbers::pi / 2);
  return out;
}

LightTruth::LightTruth(const reference::Panorama& around, double alpha)
    : roughness_(std::max(0.1, std::sqrt(alpha))),
      width_(2 * SpecularBrdf::half_width_rad(alpha)),
      around_(around),
      blurred_(blurred(PanoramaSums(around))),
      lights_(true_lights(blurred_, width_)) {}

reference::Panorama LightTruth::blurred(const PanoramaSums& sums) const {
  return mirrored_part(256, 128, [&](const reference::V3& d) { return sums.radiance(d, roughness_); });
}

LightErrors LightTruth::errors(const Descriptor& d) const {
  const reference::Panorama answer = answer_of(d);
  const reference::Panorama answer_blurred = blurred(PanoramaSums(answer));
  const std::vector<TrueLight> mirrored = true_lights(answer_blurred, width_);
  LightErrors out;
  for (const TrueLight& light : lights_) {
    LightError error;
    error.relative_irradiance = light.irradiance / lights_.front().irradiance;
    if (const Light* nearest = nearest_light(d, light.direction)) {
      error.listed_deg = reference::angle_deg(in_world(d, nearest->direction), light.direction);
      const auto& c = nearest->direction_covariance;
      error.sigma_deg = std::sqrt((static_cast<double>(c[0]) + static_cast<double>(c[2])) / 2) / kDegree;
    }
    for (const TrueLight& m : mirrored)
      error.mirrored_deg = std::min(error.mirrored_deg, reference::angle_deg(m.direction, light.direction));
    out.lights.push_back(error);
  }
  const reference::Panorama answer_seen =
      mirrored_part(answer.width, answer.height, [&](const reference::V3& w) { return reference::sample(answer, w); });
  out.balls = ball_errors(blurred_, answer_seen, answer_blurred);
  return out;
}

}  // namespace lightwell::measure
