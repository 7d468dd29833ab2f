#include "estimate/specular/gloss_operator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lightwell::specular {
namespace {

constexpr int kCoarseLevels = 12;
/// Time of an evaluation of the BRDF, in operations of WorkBudget.
constexpr std::size_t kEvaluation = 7;
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

/// sums[k] += times_cosine(v, l[k] turned by `turn_rad` about the normal). Vectorised by the compiler.
void add_turned(const SpecularBrdf& brdf, Vec3f v, std::span<const Vec3f> l, double turn_rad, float* sums) {
  const SpecularBrdf of = brdf;  // The compiler knows that `sums` does not change it.
  const auto c = std::cos(static_cast<float>(turn_rad)), s = std::sin(static_cast<float>(turn_rad));
  for (std::size_t k = 0; k < l.size(); ++k)
    sums[k] += of.times_cosine(v, {c * l[k].x - s * l[k].y, s * l[k].x + c * l[k].y, l[k].z});
}

}  // namespace

int GlossOperator::levels_for(double alpha) {
  const double half_width = SpecularBrdf::half_width_rad(alpha);
  return std::clamp(static_cast<int>(std::lround(std::numbers::pi / std::max(half_width, 1e-3))), 30, 60);
}

GlossOperator::GlossOperator(const SpecularBrdf& brdf, int levels) : GlossOperator(brdf, levels, Unbuilt{}) {
  WorkBudget unlimited(WorkBudget::kUnlimited);
  build(unlimited);
}

GlossOperator::GlossOperator(const SpecularBrdf& brdf, int levels, Unbuilt)
    : brdf_(brdf),
      grid_(levels),
      coarse_(kCoarseLevels),
      direction_(grid_.size()),
      coarse_direction_(coarse_.size()),
      solid_angle_(grid_.size()),
      albedo_(grid_.size()),
      turned_(4 * grid_.size()),
      parent_(grid_.size()),
      fine_turns_(grid_.size()),
      coarse_turns_(coarse_.size()) {
  for (std::size_t node = 0; node < grid_.size(); ++node) {
    direction_[node] = cell_direction(grid_, node);
    solid_angle_[node] = static_cast<float>(grid_.solid_angle(node));
    parent_[node] = coarse_.nearest(direction_[node]);
    const int level = grid_.level_of(node);
    const std::size_t first = HemisphereGrid::first_of(level), along = node - first;
    const auto quarter = static_cast<std::size_t>(level), all = static_cast<std::size_t>(grid_.nodes_of(level));
    for (std::size_t turn = 0; turn < 4; ++turn)
      turned_[4 * node + turn] = static_cast<std::uint32_t>(first + (along + turn * quarter) % all);
    if (level == 0 || along < quarter) quarter_.push_back(static_cast<std::uint32_t>(node));
  }
  for (std::size_t k = 0; k < coarse_.size(); ++k) coarse_direction_[k] = cell_direction(coarse_, k);
  const double near_share = 1 - std::cos(near_angle(static_cast<double>(brdf.alpha)));
  near_.reserve(static_cast<std::size_t>(near_share * static_cast<double>(quarter_.size() * grid_.size())));
  far_.reserve((quarter_.size() + kRows) * coarse_.size());
}

bool GlossOperator::build(WorkBudget& budget) {
  while (runs_end_.size() < quarter_.size()) {
    if (!budget.has(1)) return false;
    budget.spend(kEvaluation * add_row(quarter_[runs_end_.size()]));
    if (runs_end_.size() == quarter_.size()) finish();
  }
  return true;
}

std::size_t GlossOperator::add_row(std::uint32_t v) {
  const double alpha = static_cast<double>(brdf_.alpha), half_width = SpecularBrdf::half_width_rad(alpha);
  const auto near_cosine = static_cast<float>(std::cos(near_angle(alpha)));
  const std::size_t row = far_.size();
  std::size_t evaluations = coarse_.size();
  far_.resize(row + coarse_.size());
  add_turned(brdf_, direction_[v], coarse_direction_, 0, &far_[row]);
  const Vec3f mirror{-direction_[v].x, -direction_[v].y, direction_[v].z};
  for (int level = 0; level <= grid_.levels(); ++level) {
    const std::size_t first = HemisphereGrid::first_of(level), end = HemisphereGrid::first_of(level + 1);
    const double width = 2 * std::numbers::pi / HemisphereGrid::nodes_of(level);
    const auto ring = static_cast<double>(std::hypot(direction_[first].x, direction_[first].y));
    const int samples = azimuth_samples(width * ring, half_width, static_cast<double>(direction_[v].z));
    const auto is_near = [&](std::size_t l) { return dot(direction_[l], mirror) >= near_cosine; };
    for (std::size_t l = first; l < end; ++l) {
      if (!is_near(l)) continue;
      const std::size_t begin = l, at = near_.size();
      while (l < end && is_near(l)) ++l;
      const std::span<const Vec3f> cells(&direction_[begin], l - begin);
      runs_.push_back({static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(cells.size())});
      near_.resize(at + cells.size());
      for (int k = 0; k < samples; ++k)
        add_turned(brdf_, direction_[v], cells, ((k + 0.5) / samples - 0.5) * width, &near_[at]);
      for (std::size_t k = 0; k < cells.size(); ++k)
        near_[at + k] = near_[at + k] / static_cast<float>(samples) - far_[row + parent_[begin + k]];
      evaluations += cells.size() * static_cast<std::size_t>(samples);
    }
  }
  runs_end_.push_back(runs_.size());
  return evaluations;
}

void GlossOperator::finish() {
  far_.resize((quarter_.size() + kRows - 1) / kRows * kRows * coarse_.size());
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
    for (std::size_t k = 0; k < kValues; ++k) coarse.v[k] += fine.v[k];
  }
  const float *far = far_.data(), *near = near_.data();
  std::size_t run = 0;
  for (std::size_t first = 0; first < quarter_.size(); first += kRows, far += kRows * coarse_.size()) {
    std::array<Turns, kRows> sums;
    for (std::size_t k = 0; k < coarse_.size(); ++k)
      for (std::size_t r = 0; r < kRows; ++r)
        for (std::size_t n = 0; n < kValues; ++n) sums[r].v[n] += far[r * coarse_.size() + k] * coarse_turns_[k].v[n];
    for (std::size_t r = 0; r < std::min(kRows, quarter_.size() - first); ++r) {
      Turns sum = sums[r];
      for (; run < runs_end_[first + r]; ++run)
        for (const Turns *cell = &fine_turns_[runs_[run].cell], *end = cell + runs_[run].cells; cell != end;
             ++cell, ++near)
          for (std::size_t n = 0; n < kValues; ++n) sum.v[n] += *near * cell->v[n];
      for (std::size_t turn = 0; turn < 4; ++turn)
        out[turned(quarter_[first + r], turn)] = {sum.v[turn], sum.v[4 + turn], sum.v[8 + turn]};
    }
  }
}

void GlossOperator::transpose(std::span<const Radiance> weight, std::span<Radiance> out) {
  std::fill(fine_turns_.begin(), fine_turns_.end(), Turns{});
  std::fill(coarse_turns_.begin(), coarse_turns_.end(), Turns{});
  const float *far = far_.data(), *near = near_.data();
  std::size_t run = 0;
  for (std::size_t first = 0; first < quarter_.size(); first += kRows, far += kRows * coarse_.size()) {
    std::array<Turns, kRows> of;
    const std::size_t rows = std::min(kRows, quarter_.size() - first);
    for (std::size_t r = 0; r < rows; ++r)
      // The four turns of the pole are the same direction.
      for (std::size_t turn = 0; turn < (quarter_[first + r] == 0 ? 1U : 4U); ++turn) {
        const Radiance& value = weight[turned(quarter_[first + r], turn)];
        of[r].v[turn] = value.r, of[r].v[4 + turn] = value.g, of[r].v[8 + turn] = value.b;
      }
    for (std::size_t k = 0; k < coarse_.size(); ++k) {
      Turns sum = coarse_turns_[k];
      for (std::size_t r = 0; r < kRows; ++r)
        for (std::size_t n = 0; n < kValues; ++n) sum.v[n] += far[r * coarse_.size() + k] * of[r].v[n];
      coarse_turns_[k] = sum;
    }
    for (std::size_t r = 0; r < rows; ++r)
      for (; run < runs_end_[first + r]; ++run)
        for (Turns *cell = &fine_turns_[runs_[run].cell], *end = cell + runs_[run].cells; cell != end; ++cell, ++near)
          for (std::size_t n = 0; n < kValues; ++n) cell->v[n] += *near * of[r].v[n];
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
