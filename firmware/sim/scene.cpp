#include "sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace lightwell::sim {
namespace {

Panorama with_lamps_dimmed(const Panorama& lit, double factor) {
  Panorama dim = lit;
  float peak = 0;
  for (int j = 0; j < lit.height; ++j)
    for (int i = 0; i < lit.width; ++i) peak = std::max(peak, lit.pixel(i, j).luminance());
  for (std::size_t k = 0; k + 2 < dim.rgb.size(); k += 3) {
    if (Radiance{dim.rgb[k], dim.rgb[k + 1], dim.rgb[k + 2]}.luminance() <= peak / 4) continue;
    for (std::size_t c = 0; c < 3; ++c) dim.rgb[k + c] *= static_cast<float>(factor);
  }
  return dim;
}

constexpr int kSupersamplingPerAxis = 4;

/// Position of sample k of n along one axis of the pixel with centre `centre`.
double sample_position(int centre, int k, int n) { return centre - 0.5 + (k + 0.5) / n; }

}  // namespace

double MainsFlicker::factor(double middle_s, double exposure_s) const {
  const double half = std::numbers::pi * hz * exposure_s;
  const double kept = std::abs(half) < 1e-9 ? 1 : std::sin(half) / half;
  return 1 + depth * kept * std::sin(2 * std::numbers::pi * hz * middle_s);
}

Scene::Scene(Panorama panorama, Motion motion) : lamps_on_(std::move(panorama)), motion_(motion) {
  motion_.cycle_frames = std::max<std::uint64_t>(motion_.cycle_frames, 1);
  highlights_on_ = HighlightMask(lamps_on_);
  if (motion_.switch_period_frames == 0) return;
  lamps_off_ = with_lamps_dimmed(lamps_on_, motion_.off_factor);
  highlights_off_ = HighlightMask(lamps_off_);
}

SceneState Scene::state_at(std::uint64_t index, double offset_s) const {
  const std::uint64_t frame = index % motion_.cycle_frames;
  SceneState state;
  if (motion_.switch_period_frames > 0 && (frame / motion_.switch_period_frames) % 2 == 1)
    state.lamp_factor = motion_.off_factor;
  if (motion_.turn_rad_per_s == 0) return state;

  const auto cycle = static_cast<double>(motion_.cycle_frames);
  double phase = std::fmod(static_cast<double>(frame) + offset_s * motion_.frame_rate, cycle);
  if (phase < 0) phase += cycle;
  const double frames_forward = std::min(phase, cycle - phase);
  state.yaw_rad = motion_.turn_rad_per_s * frames_forward / motion_.frame_rate;
  state.rotation_world_probe = Quat::about({0, 1, 0}, state.yaw_rad);
  return state;
}

Radiance Scene::radiance(Vec3d direction_probe, const SceneState& state) const {
  return panorama(state).radiance(rotate(state.rotation_world_probe, direction_probe));
}

LensRays::LensRays(const LensParameters& lens, int samples_per_axis)
    : model_(lens),
      to_probe_(lens.pose_cv.rotation.normalized()),
      width_(lens.width),
      height_(lens.height),
      per_axis_(std::clamp(samples_per_axis, 1, 8)) {
  for (int j = 0; j < height_; ++j) {
    row_start_.push_back(seen_.size());
    rows_.push_back(sample_row(j));
  }
  samples_.shrink_to_fit();
}

/// Appends n² samples if at least one is visible. Returns the number of visible ones.
int LensRays::sample_pixel(int column, int row, std::vector<SpherePoint>& out) const {
  const std::size_t before = out.size();
  const auto add = [&](PixelPosition at) {
    if (const auto d = model_.unproject(at)) out.push_back(sphere_point(rotate(to_probe_, *d)));
  };
  for (int b = 0; b < per_axis_; ++b)
    for (int a = 0; a < per_axis_; ++a)
      add({sample_position(column, a, per_axis_), sample_position(row, b, per_axis_)});
  // The lens table includes a pixel as soon as a corner is visible, so such a pixel must not be black: use its corners.
  for (int corner = 0; corner < 4 && out.size() == before; ++corner)
    add({column - 0.5 + corner % 2, row - 0.5 + corner / 2});
  const std::size_t seen = out.size() - before;
  if (seen > 0) out.resize(before + static_cast<std::size_t>(per_axis_ * per_axis_));
  return static_cast<int>(seen);
}

/// The range of visible pixels of a row, which is contiguous for all lens models.
RowSpan LensRays::sample_row(int row) {
  RowSpan span;
  for (int i = 0; i < width_; ++i) {
    const int count = sample_pixel(i, row, samples_);
    if (count == 0) {
      if (span.end > 0) break;
      continue;
    }
    if (span.end == 0) span.first = i;
    span.end = i + 1;
    seen_.push_back(static_cast<std::uint8_t>(count));
  }
  return span;
}

Radiance LensRays::supersample(const Panorama& world, std::uint32_t shift, int column, int row) const {
  const int n = per_axis_ * kSupersamplingPerAxis;
  Radiance sum;
  int count = 0;
  for (int b = 0; b < n; ++b) {
    for (int a = 0; a < n; ++a) {
      const auto d = model_.unproject({sample_position(column, a, n), sample_position(row, b, n)});
      if (!d) continue;
      const SpherePoint point = sphere_point(rotate(to_probe_, *d));
      sum += world.radiance(SpherePoint{point.u - shift, point.v});
      ++count;
    }
  }
  return sum * (1 / static_cast<float>(std::max(count, 1)));
}

void LensRays::render(const Scene& scene, const SceneState& state, RowSpan rows, std::span<float> out) const {
  const Panorama& world = scene.panorama(state);
  const HighlightMask& highlights = scene.highlights(state);
  // phi_world = phi_probe - yaw for a right-handed rotation about +Y; u is phi in turns.
  const double turns = state.yaw_rad / (2 * std::numbers::pi);
  const auto shift = static_cast<std::uint32_t>(static_cast<std::int64_t>(std::llround(turns * 4294967296.0)));
  const auto width = static_cast<std::size_t>(width_);
  const auto per_pixel = static_cast<std::size_t>(per_axis_ * per_axis_);

  for (int j = rows.first; j < rows.end; ++j) {
    const auto row = static_cast<std::size_t>(j);
    const RowSpan span = rows_[row];
    float* pixel = out.data() + 3 * width * row;
    std::fill(pixel, pixel + 3 * width, 0.0F);
    pixel += 3 * static_cast<std::size_t>(span.first);
    std::size_t k = row_start_[row];
    for (int i = span.first; i < span.end; ++i, ++k, pixel += 3) {
      const SpherePoint* sample = samples_.data() + k * per_pixel;
      const int count = seen_[k];
      Radiance sum;
      bool glaring = false;
      for (int n = 0; n < count; ++n) {
        const SpherePoint point{sample[n].u - shift, sample[n].v};
        glaring = glaring || highlights.at(point);
        sum += world.radiance(point);
      }
      const Radiance mean = glaring ? supersample(world, shift, i, j) : sum * (1 / static_cast<float>(count));
      pixel[0] = mean.r;
      pixel[1] = mean.g;
      pixel[2] = mean.b;
    }
  }
}

int samples_for(const LensParameters& lens, const Panorama& panorama) {
  const CameraModel model(lens);
  const double x = (lens.width - 1) / 2.0, y = (lens.height - 1) / 2.0;
  const auto here = model.unproject({x, y}), next = model.unproject({x + 1, y});
  if (!here || !next) return 2;
  const double wanted_rad = std::numbers::pi / panorama.width;
  // Tolerance for rounding: an equirectangular lens of the panorama's size needs two samples, not three.
  return std::clamp(static_cast<int>(std::ceil(angle_between(*here, *next) / wanted_rad - 1e-3)), 2, 8);
}

std::vector<float> render_radiance(const Scene& scene, const SceneState& state, const LensParameters& lens,
                                   int samples_per_axis) {
  std::vector<float> out(3 * static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height));
  LensRays(lens, samples_per_axis).render(scene, state, {0, lens.height}, out);
  return out;
}

}  // namespace lightwell::sim
