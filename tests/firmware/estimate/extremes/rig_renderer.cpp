#include "firmware/estimate/extremes/rig_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <string>

#include "sim/sensor.hpp"

namespace lightwell::extremes {
namespace {

constexpr int kDiscSamples = 12;
/// Smallest width at which pixels are fine enough as patches; smaller images are subdivided.
constexpr int kTruthWidth = 256;

template <class T>
T or_exit(Result<T> made, const char* what) {
  if (made.ok()) return std::move(*made);
  std::fprintf(stderr, "extremes: %s: %s\n", what, made.status().message().c_str());
  std::exit(1);
}

/// Scales a lens to another image size; `share`: ratio of focal lengths in pixels.
void resize(LensParameters& lens, int width, int height, double share) {
  lens.width = width;
  lens.height = height;
  std::visit(
      [&](auto& model) {
        if constexpr (requires { model.fx; }) {
          model.fx *= share;
          model.fy *= share;
          model.cx = (width - 1) / 2.0;
          model.cy = (height - 1) / 2.0;
        }
      },
      lens.model);
}

}  // namespace

RigParameters rig_of(const char* kind, int width, int height, PixelFormat format) {
  const bool sphere = std::string(kind) == "equirect";
  if (width >= 16 && height >= 8 && (!sphere || width == 2 * height))
    return or_exit(sim::make_rig(kind, width, height, format), kind);
  RigParameters rig = or_exit(sim::make_rig(kind, 64, sphere ? 32 : 64, format), kind);
  for (LensParameters& lens : rig.lenses) resize(lens, width, height, std::min(width, height) / 64.0);
  return rig;
}

RigParameters rig_that_sees(double share, int width, int height) {
  RigParameters rig = rig_of("single", width, height);
  LensParameters& lens = rig.lenses[0];
  lens.max_angle_rad = std::acos(1 - 2 * share);
  return rig;
}

PixelTruth::PixelTruth(const RigParameters& rig, int normals) : normals_(reference::fibonacci_normals(normals)) {
  const RigTable coarse = or_exit(make_rig_table(rig), "rig table");
  RigParameters fine = rig;
  std::vector<int> steps;
  for (LensParameters& lens : fine.lenses) {
    const int n = std::max(1, kTruthWidth / std::max(lens.width, lens.height));
    steps.push_back(n);
    LensParameters was = lens;
    resize(lens, lens.width * n, lens.height * n, n);
    std::visit(
        [&](auto& model) {
          if constexpr (requires { model.cx; }) {
            const auto& old = std::get<std::decay_t<decltype(model)>>(was.model);
            model.cx = n * (old.cx + 0.5) - 0.5;
            model.cy = n * (old.cy + 0.5) - 0.5;
          }
        },
        lens.model);
  }
  const RigTable table = or_exit(make_rig_table(fine), "finer rig table");
  for (std::size_t k = 0; k < table.lenses.size(); ++k) {
    const LensTable& lens = table.lenses[k];
    for (std::size_t i = 0; i < lens.direction.size(); ++i) {
      const auto width = static_cast<std::size_t>(lens.width), n = static_cast<std::size_t>(steps[k]);
      const std::size_t pixel = i / width / n * static_cast<std::size_t>(coarse.lenses[k].width) + i % width / n;
      if (!(lens.solid_angle[i] > 0) || !(coarse.lenses[k].solid_angle[pixel] > 0)) continue;
      patches_.push_back({k, pixel});
      x_.push_back(lens.direction[i].x);
      y_.push_back(lens.direction[i].y);
      z_.push_back(lens.direction[i].z);
      solid_angle_.push_back(lens.solid_angle[i]);
    }
  }
}

std::vector<reference::Rgb> PixelTruth::irradiance(const Pictures& pictures) const {
  constexpr std::size_t kLanes = 8, kRun = 512;
  const std::size_t count = patches_.size();
  std::vector<float> light[3];
  for (int c = 0; c < 3; ++c) light[c].resize(count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      light[c][i] = solid_angle_[i] * pictures[patches_[i].lens][3 * patches_[i].pixel + c];
  std::vector<reference::Rgb> out;
  for (const reference::V3& n : normals_) {
    const auto nx = static_cast<float>(n.x), ny = static_cast<float>(n.y), nz = static_cast<float>(n.z);
    double sum[3] = {};
    // Sums runs in float, in lanes that vectorize, then in double.
    for (std::size_t first = 0; first < count; first += kRun) {
      const std::size_t end = std::min(count, first + kRun);
      float lanes[3][kLanes] = {};
      std::size_t i = first;
      for (; i + kLanes <= end; i += kLanes)
        for (std::size_t j = 0; j < kLanes; ++j) {
          const float cosine = nx * x_[i + j] + ny * y_[i + j] + nz * z_[i + j];
          const float facing = cosine > 0 ? cosine : 0;
          lanes[0][j] += facing * light[0][i + j];
          lanes[1][j] += facing * light[1][i + j];
          lanes[2][j] += facing * light[2][i + j];
        }
      for (; i < end; ++i)
        for (std::size_t c = 0; c < 3; ++c)
          lanes[c][0] += std::max(0.0F, nx * x_[i] + ny * y_[i] + nz * z_[i]) * light[c][i];
      for (std::size_t c = 0; c < 3; ++c)
        for (const float lane : lanes[c]) sum[c] += lane;
    }
    out.push_back({sum[0], sum[1], sum[2]});
  }
  return out;
}

RigRenderer::RigRenderer(RigParameters rig) : rig_(std::move(rig)), table_(or_exit(make_rig_table(rig_), "rig table")) {
  std::size_t pixels = 0;
  for (const LensParameters& lens : rig_.lenses) models_.emplace_back(lens);
  for (const LensTable& lens : table_.lenses)
    pixels += static_cast<std::size_t>(std::ranges::count_if(lens.solid_angle, [](float w) { return w > 0; }));
  pixel_rad_ = std::sqrt(table_.covered_sr / static_cast<double>(std::max<std::size_t>(pixels, 1)));
}

const PixelTruth& RigRenderer::truth() const {
  if (!truth_) truth_ = std::make_shared<PixelTruth>(rig_);
  return *truth_;
}

Pictures RigRenderer::render(const Scene& scene) const {
  Pictures out;
  for (const LensTable& lens : table_.lenses) {
    std::vector<float>& pixels = out.emplace_back(3 * lens.direction.size());
    for (std::size_t i = 0; i < lens.direction.size(); ++i) {
      if (!(lens.solid_angle[i] > 0)) continue;
      const Radiance l = scene.ambient(vec_cast<double>(lens.direction[i]));
      pixels[3 * i] = l.r, pixels[3 * i + 1] = l.g, pixels[3 * i + 2] = l.b;
    }
  }
  for (const Disc& disc : scene.discs) add(disc, out);
  return out;
}

float RigRenderer::covered_share(const Disc& disc, std::size_t lens, int x, int y) const {
  const double edge = std::cos(disc.radius_rad);
  // In an equirectangular image, solid angle varies within a pixel, strongly near the poles.
  const bool sphere = table_.lenses[lens].equirectangular;
  double seen = 0, inside = 0;
  for (int j = 0; j < kDiscSamples; ++j)
    for (int i = 0; i < kDiscSamples; ++i) {
      const auto d = models_[lens].unproject({x + (i + 0.5) / kDiscSamples - 0.5, y + (j + 0.5) / kDiscSamples - 0.5});
      if (!d) continue;
      const Vec3d at = rotate(rig_.lenses[lens].pose_cv.rotation, *d);
      const double weight = sphere ? std::sqrt(std::max(0.0, 1 - at.y * at.y)) : 1;
      seen += weight;
      if (dot(at, disc.axis) >= edge) inside += weight;
    }
  return seen > 0 ? static_cast<float>(inside / seen) : 0;
}

void RigRenderer::add(const Disc& disc, Pictures& pictures) const {
  // Corners of pixels are farther than half a side where a lens stretches pixels.
  const double reach = 2 * pixel_rad_;
  const auto far = static_cast<float>(std::cos(std::min(disc.radius_rad + reach, std::numbers::pi)));
  const auto near = static_cast<float>(std::cos(std::max(disc.radius_rad - reach, 0.0)));
  const Vec3f axis = vec_cast<float>(disc.axis);
  for (std::size_t k = 0; k < table_.lenses.size(); ++k) {
    const LensTable& lens = table_.lenses[k];
    for (std::size_t i = 0; i < lens.direction.size(); ++i) {
      const float c = dot(lens.direction[i], axis);
      if (c < far || !(lens.solid_angle[i] > 0)) continue;
      const auto width = static_cast<std::size_t>(lens.width);
      const float share =
          c > near ? 1 : covered_share(disc, k, static_cast<int>(i % width), static_cast<int>(i / width));
      for (int channel = 0; channel < 3; ++channel)
        pictures[k][3 * i + static_cast<std::size_t>(channel)] += share * disc.radiance[channel];
    }
  }
}

Shot RigRenderer::as_floats(const Pictures& pictures) const {
  Shot out;
  out.frame.info.exposure_s = 1;
  for (const std::vector<float>& p : pictures) {
    std::vector<std::byte>& bytes = out.bytes.emplace_back(p.size() * sizeof(float));
    std::memcpy(bytes.data(), p.data(), bytes.size());
  }
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const LensParameters& lens = rig_.lenses[k];
    out.frame.add_view({static_cast<int>(k), PixelFormat::rgb_f32, lens.width, lens.height,
                        packed_stride(PixelFormat::rgb_f32, lens.width), out.bytes[k]});
  }
  return out;
}

Shot RigRenderer::as_rgb8(const Pictures& pictures, double exposure_s, std::uint64_t number) const {
  Shot out;
  out.frame.info.exposure_s = exposure_s;
  const sim::SensorModel model = sim::sensor_of(rig_, PixelFormat::rgb8, 1);
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const sim::Sensor sensor(rig_.lenses[k], model);
    sensor.expose(pictures[k], {exposure_s, 1, number, static_cast<int>(k)}, out.bytes.emplace_back(sensor.bytes()));
  }
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const LensParameters& lens = rig_.lenses[k];
    out.frame.add_view({static_cast<int>(k), PixelFormat::rgb8, lens.width, lens.height,
                        packed_stride(PixelFormat::rgb8, lens.width), out.bytes[k]});
  }
  return out;
}

}  // namespace lightwell::extremes
