#include "firmware/pose/body_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace lightwell::test {

namespace {

constexpr double kBackground = 0.25;

/// A background that a search for quads has to process: an illumination gradient and boxes of all sizes.
std::vector<float> clutter_of(int width, int height, std::uint64_t seed) {
  std::vector<float> out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      out[static_cast<std::size_t>(y * width + x)] = static_cast<float>(0.15 + 0.2 * x / width + 0.1 * y / height);
  for (int i = 0; i < 150; ++i) {
    const int w = static_cast<int>(8 + 150 * std::pow(unit(random), 2)),
              h = static_cast<int>(8 + 150 * std::pow(unit(random), 2));
    const int x0 = static_cast<int>(unit(random) * width) - w / 2, y0 = static_cast<int>(unit(random) * height) - h / 2;
    const auto value = static_cast<float>(0.03 + 0.6 * unit(random));
    for (int y = std::max(0, y0); y < std::min(height, y0 + h); ++y)
      for (int x = std::max(0, x0); x < std::min(width, x0 + w); ++x)
        out[static_cast<std::size_t>(y * width + x)] = value;
  }
  return out;
}

void blur(std::vector<float>& picture, int width, int height, double sigma) {
  if (!(sigma > 0)) return;
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  std::vector<float> kernel;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-i * i / (2 * sigma * sigma))));
    sum += kernel.back();
  }
  std::vector<float> line;
  const auto pass = [&](int count, int length, int next, int step) {
    line.resize(static_cast<std::size_t>(length));
    for (int k = 0; k < count; ++k) {
      float* const first = picture.data() + static_cast<std::ptrdiff_t>(k) * next;
      for (int i = 0; i < length; ++i) line[static_cast<std::size_t>(i)] = first[static_cast<std::ptrdiff_t>(i) * step];
      for (int i = 0; i < length; ++i) {
        float mean = 0;
        for (int j = -reach; j <= reach; ++j)
          mean += kernel[static_cast<std::size_t>(j + reach)] *
                  line[static_cast<std::size_t>(std::clamp(i + j, 0, length - 1))];
        first[static_cast<std::ptrdiff_t>(i) * step] = mean / sum;
      }
    }
  };
  pass(height, width, width, 1);
  pass(width, height, 1, width);
}

/// Interpolates between two poses; `share` is 0 at `a` and 1 at `b`.
Pose between(const Pose& a, const Pose& b, double share) {
  Quat q = b.rotation * a.rotation.inverse();
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  const double angle = 2 * std::acos(std::min(1.0, q.w));
  const Vec3d axis = normalized(Vec3d{q.x, q.y, q.z});
  return {(angle > 1e-9 ? Quat::about(axis, share * angle) * a.rotation : a.rotation).normalized(),
          a.translation + (b.translation - a.translation) * share};
}

}  // namespace

BodyCamera::BodyCamera(const RigParameters& rig, const MarkerBody& body, std::uint64_t clutter_seed)
    : camera_(rig.lenses.front()), clutter_(clutter_of(camera_.width(), camera_.height(), clutter_seed)) {
  scene_.body = body;
  // A lamp from above left and bright ambient light: face values between 0.2 and 0.7.
  scene_.lamps = {reference::DistantLamp{{-0.5, 0.7, 0.5}, {1.9, 1.9, 1.9}, 0}};
  scene_.ambient = reference::even_ambient({0.25, 0.25, 0.25});
  scene_.background = {kBackground, kBackground, kBackground};
}

std::vector<float> BodyCamera::radiance_at(const Pose& probe_body, const BodyShot& shot) const {
  reference::MarkerScene scene = scene_;
  scene.probe_body = probe_body;
  if (shot.occluder) scene.occluders.push_back(*shot.occluder);
  reference::RenderOptions options;
  options.samples = shot.closing_pose ? 2 : 3;
  const reference::RadiancePicture picture = reference::render(scene, camera_, options);
  std::vector<float> out(clutter_.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const float value = picture.rgb[3 * i];
    out[i] = value == static_cast<float>(kBackground) ? clutter_[i] : value;
  }
  return out;
}

reference::GreyBytes BodyCamera::take(const Pose& probe_body, std::uint64_t seed) const {
  BodyShot shot;
  shot.probe_body = probe_body;
  shot.seed = seed;
  return take(shot);
}

std::vector<float> BodyCamera::radiance(const BodyShot& shot) const {
  if (!shot.closing_pose) return radiance_at(shot.probe_body, shot);
  constexpr int kInstants = 8;
  std::vector<float> sum(clutter_.size());
  for (int i = 0; i < kInstants; ++i) {
    const auto now = radiance_at(between(shot.probe_body, *shot.closing_pose, (i + 0.5) / kInstants), shot);
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += now[k] / kInstants;
  }
  return sum;
}

reference::GreyBytes BodyCamera::expose(std::vector<float> radiance, const BodyShot& shot) const {
  const int width = camera_.width(), height = camera_.height();
  blur(radiance, width, height, shot.blur_px);
  reference::RadiancePicture picture{width, height, std::vector<float>(3 * radiance.size())};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto to = static_cast<std::size_t>(y * width + (shot.mirrored ? width - 1 - x : x));
      for (std::size_t c = 0; c < 3; ++c) picture.rgb[3 * to + c] = radiance[static_cast<std::size_t>(y * width + x)];
    }
  reference::ExposureOptions exposure;
  exposure.full_scale = 1 / shot.exposure;
  exposure.electrons = shot.electrons;
  exposure.read_noise_electrons = shot.read_noise_electrons;
  exposure.srgb = shot.srgb;
  exposure.seed = shot.seed;
  return reference::expose_grey(picture, exposure);
}

}  // namespace lightwell::test
