#include "estimate/specular/gloss_operator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lightwell::specular {
namespace {

constexpr int kCoarseLevels = 12;
/// Half angle around the mirror direction with a coefficient for each cell: at least the coarse spacing, and eight half
/// widths of the lobe.
double near_angle(double alpha) {
  return std::clamp(8 * SpecularBrdf::half_width_rad(alpha), std::numbers::pi / kCoarseLevels, 1.0);
}

/// Nodes at the horizon are evaluated half a spacing above it, where their cell is.
Vec3f cell_direction(const HemisphereGrid& grid, std::size_t node) {
  const Vec3d d = grid.direction(node);
  const double lift = std::sin(0.25 * grid.spacing_rad());
  return vec_cast<float>(d.z > lift ? d : normalized(Vec3d{d.x, d.y, lift}));
}

/// Samples over a cell's arc of azimuth. At grazing angles the lobe is narrower in azimuth than a cell: its
/// half width is multiplied by the sine of the elevation.
int azimuth_samples(double arc_rad, double half_width, double sine) {
  return std::clamp(static_cast<int>(std::ceil(arc_rad / (half_width * sine))), 1, 16);
}

/// Mean of times_cosine() over the azimuths of a cell around `l`.
float mean_over_cell(const SpecularBrdf& brdf, Vec3f v, Vec3f l, double width_rad, int samples) {
  if (samples == 1) return brdf.times_cosine(v, l);
  float sum = 0;
  for (int k = 0; k < samples; ++k) {
    const auto turn = static_cast<float>(((k + 0.5) / samples - 0.5) * width_rad);
    const float c = std::cos(turn), s = std::sin(turn);
    sum += brdf.times_cosine(v, {c * l.x - s * l.y, s * l.x + c * l.y, l.z});
  }
  return sum / static_cast<float>(samples);
}

}  // namespace

int GlossOperator::levels_for(double alpha) {
  const double half_width = SpecularBrdf::half_width_rad(alpha);
  return std::clamp(static_cast<int>(std::lround(std::numbers::pi / std::max(half_width, 1e-3))), 30, 60);
}

GlossOperator::GlossOperator(const SpecularBrdf& brdf, int levels)
    : brdf_(brdf),
      grid_(levels),
      coarse_(kCoarseLevels),
      solid_angle_(grid_.size()),
      albedo_(grid_.size()),
      turned_(4 * grid_.size()),
      parent_(grid_.size()),
      fine_turns_(grid_.size()),
      coarse_turns_(coarse_.size()) {
  std::vector<Vec3f> direction(grid_.size()), coarse_direction(coarse_.size());
  for (std::size_t node = 0; node < grid_.size(); ++node) {
    direction[node] = cell_direction(grid_, node);
    solid_angle_[node] = static_cast<float>(grid_.solid_angle(node));
    parent_[node] = coarse_.nearest(direction[node]);
    const int level = grid_.level_of(node);
    const std::size_t first = HemisphereGrid::first_of(level), along = node - first;
    const auto quarter = static_cast<std::size_t>(level), all = static_cast<std::size_t>(grid_.nodes_of(level));
    for (std::size_t turn = 0; turn < 4; ++turn)
      turned_[4 * node + turn] = static_cast<std::uint32_t>(first + (along + turn * quarter) % all);
    if (level == 0 || along < quarter) quarter_.push_back(static_cast<std::uint32_t>(node));
  }
  for (std::size_t k = 0; k < coarse_.size(); ++k) coarse_direction[k] = cell_direction(coarse_, k);
  const auto near_cosine = static_cast<float>(std::cos(near_angle(static_cast<double>(brdf.alpha))));
  const double half_width = SpecularBrdf::half_width_rad(static_cast<double>(brdf.alpha));
  far_.reserve(quarter_.size() * coarse_.size());
  for (const std::uint32_t v : quarter_) {
    const std::size_t row = far_.size();
    for (const Vec3f& l : coarse_direction) far_.push_back(brdf.times_cosine(direction[v], l));
    const Vec3f mirror{-direction[v].x, -direction[v].y, direction[v].z};
    for (std::size_t l = 0; l < grid_.size(); ++l) {
      if (dot(direction[l], mirror) < near_cosine) continue;
      const double width = 2 * std::numbers::pi / HemisphereGrid::nodes_of(grid_.level_of(l));
      const auto ring = static_cast<double>(std::hypot(direction[l].x, direction[l].y));
      const int samples = azimuth_samples(width * ring, half_width, static_cast<double>(direction[v].z));
      near_.push_back({static_cast<std::uint32_t>(l),
                       mean_over_cell(brdf, direction[v], direction[l], width, samples) - far_[row + parent_[l]]});
    }
    near_end_.push_back(near_.size());
  }
  std::vector<Radiance> ones(grid_.size(), Radiance{1, 1, 1}), reflected(grid_.size());
  reflect(ones, reflected);
  for (std::size_t v = 0; v < grid_.size(); ++v) albedo_[v] = reflected[v].r;
}

void GlossOperator::reflect(std::span<const Radiance> radiance, std::span<Radiance> out) {
  std::fill(coarse_turns_.begin(), coarse_turns_.end(), Turns{});
  for (std::size_t l = 0; l < grid_.size(); ++l) {
    Turns& fine = fine_turns_[l];
    Turns& coarse = coarse_turns_[parent_[l]];
    for (std::size_t turn = 0; turn < 4; ++turn) {
      const Radiance& value = radiance[turned(l, turn)];
      fine.v[turn] = value.r * solid_angle_[l];
      fine.v[4 + turn] = value.g * solid_angle_[l];
      fine.v[8 + turn] = value.b * solid_angle_[l];
    }
    for (std::size_t k = 0; k < 16; ++k) coarse.v[k] += fine.v[k];
  }
  std::size_t at = 0;
  const float* far = far_.data();
  for (std::size_t row = 0; row < quarter_.size(); ++row, far += coarse_.size()) {
    Turns sum;
    for (std::size_t k = 0; k < coarse_.size(); ++k)
      for (std::size_t n = 0; n < 16; ++n) sum.v[n] += far[k] * coarse_turns_[k].v[n];
    for (; at < near_end_[row]; ++at)
      for (std::size_t n = 0; n < 16; ++n) sum.v[n] += near_[at].coefficient * fine_turns_[near_[at].cell].v[n];
    for (std::size_t turn = 0; turn < 4; ++turn)
      out[turned(quarter_[row], turn)] = {sum.v[turn], sum.v[4 + turn], sum.v[8 + turn]};
  }
}

void GlossOperator::transpose(std::span<const Radiance> weight, std::span<Radiance> out) {
  std::fill(fine_turns_.begin(), fine_turns_.end(), Turns{});
  std::fill(coarse_turns_.begin(), coarse_turns_.end(), Turns{});
  std::size_t at = 0;
  const float* far = far_.data();
  for (std::size_t row = 0; row < quarter_.size(); ++row, far += coarse_.size()) {
    Turns of;
    // The four turns of the pole are the same direction.
    for (std::size_t turn = 0; turn < (quarter_[row] == 0 ? 1U : 4U); ++turn) {
      const Radiance& value = weight[turned(quarter_[row], turn)];
      of.v[turn] = value.r, of.v[4 + turn] = value.g, of.v[8 + turn] = value.b;
    }
    for (std::size_t k = 0; k < coarse_.size(); ++k)
      for (std::size_t n = 0; n < 16; ++n) coarse_turns_[k].v[n] += far[k] * of.v[n];
    for (; at < near_end_[row]; ++at)
      for (std::size_t n = 0; n < 16; ++n) fine_turns_[near_[at].cell].v[n] += near_[at].coefficient * of.v[n];
  }
  std::fill(out.begin(), out.end(), Radiance{});
  for (std::size_t l = 0; l < grid_.size(); ++l) {
    const Turns &fine = fine_turns_[l], &coarse = coarse_turns_[parent_[l]];
    for (std::size_t turn = 0; turn < 4; ++turn)
      out[turned(l, turn)] += Radiance{fine.v[turn] + coarse.v[turn], fine.v[4 + turn] + coarse.v[4 + turn],
                                       fine.v[8 + turn] + coarse.v[8 + turn]};
  }
  for (std::size_t l = 0; l < grid_.size(); ++l) out[l] = out[l] * solid_angle_[l];
}

}  // namespace lightwell::specular
