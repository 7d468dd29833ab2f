#include <algorithm>
#include <cmath>
#include <utility>

#include <lightwell/plane_appearance.hpp>

#include "core/plane_state.hpp"

namespace lightwell {
namespace {

/// Weights of nodes and texels below this are rounding errors of float and count as 0.
constexpr float kMinWeight = 1e-5F;
constexpr int kMaxPixels = 32768;
constexpr int kSilentKeyIntervals = 3;

bool finite(double a, double b) { return std::isfinite(a) && std::isfinite(b); }

/// invalid_query is worse than none, none than stale, stale than valid.
Validity worse(Validity a, Validity b) {
  const auto rank = [](Validity v) {
    return v == Validity::valid ? 0 : v == Validity::stale ? 1 : v == Validity::invalid_query ? 3 : 2;
  };
  return rank(a) > rank(b) ? a : b;
}

/// Sum of weighted entries and what is known of them.
struct Sum {
  Radiance value;
  Validity validity = Validity::valid;
  PlaneFlags flags;
};

/// D at a point of the texture's frame within the square.
Sum texture_at(const core::PlaneState& state, PlanePoint p) {
  const PlaneTexture& texture = state.plane.texture;
  const int last = texture.edge - 1;
  const double scale = texture.edge / state.plane.info.size_m;
  const double x = std::clamp(p.x * scale + 0.5 * texture.edge - 0.5, 0.0, static_cast<double>(last));
  const double y = std::clamp(0.5 * texture.edge - p.y * scale - 0.5, 0.0, static_cast<double>(last));
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const auto fx = static_cast<float>(x - i), fy = static_cast<float>(y - j);
  const std::array<float, 4> weight{(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  Sum out;
  float seen = 0;
  for (int k = 0; k < 4; ++k) {
    const float w = weight[static_cast<std::size_t>(k)];
    if (w < kMinWeight) continue;
    const int column = std::min(i + k % 2, last), row = std::min(j + k / 2, last);
    const auto at =
        static_cast<std::size_t>(row) * static_cast<std::size_t>(texture.edge) + static_cast<std::size_t>(column);
    out.validity = worse(out.validity, state.freshness(PlanePart::texture, at));
    if (texture.state[at] == SampleState::unseen) {
      out.flags.set(PlaneFlag::unseen_texel);
      continue;
    }
    if (texture.state[at] == SampleState::clipped) out.flags.set(PlaneFlag::clipped_texel);
    out.value += texture.radiance[at] * w;
    seen += w;
  }
  if (seen > 0) out.value = out.value * (1 / seen);
  return out;
}

/// S towards a viewer in front of the plane.
Sum lumisphere_at(const core::PlaneState& state, Vec3f to_viewer) {
  const PlaneLumisphere& lumisphere = state.plane.lumisphere;
  const HemisphereGrid::Interpolation where = lumisphere.grid.interpolate(to_viewer);
  Sum out;
  for (std::size_t k = 0; k < where.node.size(); ++k) {
    const std::size_t node = where.node[k];
    if (where.weight[k] < kMinWeight) continue;
    out.validity = worse(out.validity, state.freshness(PlanePart::lumisphere, node));
    if (lumisphere.state[node] == SampleState::unseen) out.flags.set(PlaneFlag::unseen_direction);
    if (lumisphere.state[node] == SampleState::clipped) out.flags.set(PlaneFlag::clipped_direction);
    out.value += lumisphere.radiance[node] * where.weight[k];
  }
  return out;
}

void add(const Sum& part, Sum& to) {
  to.value += part.value;
  to.validity = worse(to.validity, part.validity);
  to.flags |= part.flags;
}

bool in_square(PlanePoint texture, double size_m) {
  // False for NaN.
  return std::abs(texture.x) <= size_m / 2 && std::abs(texture.y) <= size_m / 2;
}

/// An answer without a value where `sum` is not there.
PlaneAnswer answer_of(const Sum& sum, Validity base) {
  const Validity validity = worse(sum.validity, base);
  if (validity != Validity::valid && validity != Validity::stale) return {{}, validity, {}};
  return {sum.value, validity, sum.flags};
}

PlaneAnswer no_answer(Validity validity) { return {{}, validity, {}}; }

/// The vector in float, scaled so that no component overflows. Requires is_finite(v).
Vec3f direction_of(Vec3d v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return largest > 0 ? vec_cast<float>(v * (1 / largest)) : Vec3f{};
}

bool usable(const PlaneCamera& c) {
  const Quat& q = c.T_plane_camera.rotation;
  return c.width >= 1 && c.height >= 1 && c.width <= kMaxPixels && c.height <= kMaxPixels && c.fx > 0 && c.fy > 0 &&
         finite(c.fx, c.fy) && finite(c.cx, c.cy) && is_finite(c.T_plane_camera.translation) &&
         std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) < 1e-6;
}

}  // namespace

PlaneAppearance::PlaneAppearance(std::shared_ptr<const core::PlaneState> state, HostTime now)
    : state_(std::move(state)), age_(state_ ? std::max(Duration{}, now - state_->received) : Duration{}) {}

Validity PlaneAppearance::validity() const {
  if (!state_) return Validity::none;
  const bool silent = age_.ns / kSilentKeyIntervals >= state_->key_interval.ns;
  return silent || state_->missing > 0 ? Validity::stale : Validity::valid;
}

std::uint64_t PlaneAppearance::revision() const { return state_ ? state_->revision : 0; }
std::size_t PlaneAppearance::missing_tiles() const { return state_ ? state_->missing : 0; }
int PlaneAppearance::texture_edge() const { return state_ ? state_->plane.texture.edge : 0; }

const PlaneInfo& PlaneAppearance::info() const {
  static const PlaneInfo kNone;
  return state_ ? state_->plane.info : kNone;
}

const PlaneCoverage& PlaneAppearance::coverage() const {
  static const PlaneCoverage kNone{HemisphereGrid(1), std::vector<std::uint8_t>(HemisphereGrid(1).size())};
  return state_ ? state_->plane.coverage : kNone;
}

PlaneGuidance PlaneAppearance::guidance(const PlaneGuidanceOptions& options) const {
  return plane_guidance(coverage(), options);
}

Validity PlaneAppearance::base_validity(PlaneLayers layers) const {
  if (!state_ || (layers != PlaneLayers::specular && state_->plane.texture.edge == 0)) return Validity::none;
  return age_.ns / kSilentKeyIntervals >= state_->key_interval.ns ? Validity::stale : Validity::valid;
}

PlaneAnswer PlaneAppearance::radiance(PlanePoint point, Vec3d eye, PlaneLayers layers) const {
  if (!finite(point.x, point.y) || !is_finite(eye) || !(eye.z > 0)) return no_answer(Validity::invalid_query);
  const Validity base = base_validity(layers);
  if (base == Validity::none) return no_answer(base);
  const PlaneInfo& info = state_->plane.info;
  const PlanePoint texture = info.texture_to_plane.texture_point(point);
  if (!in_square(texture, info.size_m)) return no_answer(Validity::invalid_query);
  Sum sum;
  if (layers != PlaneLayers::specular) add(texture_at(*state_, texture), sum);
  if (layers != PlaneLayers::diffuse) add(lumisphere_at(*state_, direction_of(eye - Vec3d{point.x, point.y, 0})), sum);
  return answer_of(sum, base);
}

PlaneAnswer PlaneAppearance::diffuse(PlanePoint point) const {
  return radiance(point, {0, 0, 1}, PlaneLayers::diffuse);
}

PlaneAnswer PlaneAppearance::specular(Vec3d to_viewer) const {
  if (!is_finite(to_viewer) || !(to_viewer.z > 0)) return no_answer(Validity::invalid_query);
  const Validity base = base_validity(PlaneLayers::specular);
  if (base == Validity::none) return no_answer(base);
  return answer_of(lumisphere_at(*state_, direction_of(to_viewer)), base);
}

PlaneRendering PlaneAppearance::render(const PlaneCamera& camera, PlaneLayers layers, std::span<float> rgb,
                                       std::span<std::uint8_t> flags) const {
  PlaneRendering out;
  out.validity = Validity::invalid_query;
  if (!usable(camera)) return out;
  const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  const Vec3d eye = camera.T_plane_camera.translation;
  if (rgb.size() != 3 * pixels || (!flags.empty() && flags.size() != pixels) || !(eye.z > 0)) return out;
  const Validity base = base_validity(layers);
  out.validity = base;
  if (base == Validity::none) return out;
  const PlaneInfo& info = state_->plane.info;
  const Quat& q = camera.T_plane_camera.rotation;
  const Vec3d per_column = rotate(q, Vec3d{1 / camera.fx, 0, 0}), per_row = rotate(q, Vec3d{0, -1 / camera.fy, 0});
  const Vec3d first = rotate(q, Vec3d{-camera.cx / camera.fx, camera.cy / camera.fy, -1});
  // The same similarity for all pixels, without its trigonometric functions.
  const PlanePoint origin = info.texture_to_plane.texture_point({0, 0});
  const PlanePoint one = info.texture_to_plane.texture_point({1, 0});
  const double c = one.x - origin.x, s = one.y - origin.y;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const Vec3d ray = first + per_column * static_cast<double>(column) + per_row * static_cast<double>(row);
      if (!(ray.z < 0)) continue;
      const double t = -eye.z / ray.z, x = eye.x + t * ray.x, y = eye.y + t * ray.y;
      const PlanePoint texture{c * x - s * y + origin.x, s * x + c * y + origin.y};
      if (!in_square(texture, info.size_m)) continue;
      Sum sum;
      if (layers != PlaneLayers::specular) add(texture_at(*state_, texture), sum);
      if (layers != PlaneLayers::diffuse) add(lumisphere_at(*state_, direction_of(-ray)), sum);
      out.validity = worse(out.validity, sum.validity);
      if (sum.validity == Validity::none) continue;
      const std::size_t pixel =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(column);
      for (int k = 0; k < 3; ++k) rgb[3 * pixel + static_cast<std::size_t>(k)] = sum.value[k];
      if (!flags.empty()) flags[pixel] = sum.flags.bits();
      out.flags |= sum.flags;
      ++out.pixels;
      if (sum.flags.any()) ++out.flagged;
    }
  return out;
}

}  // namespace lightwell
