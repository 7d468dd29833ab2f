// Spots: a hot pixel, the sun, discs anywhere.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/text.hpp>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Compares the light nearest to `axis` with the spot.
void evaluate_spot(const Descriptor& d, Vec3d axis, double energy, const std::string& where, SpotRow& row) {
  const Light* nearest = nullptr;
  for (const Light& l : d.lights)
    if (nearest == nullptr ||
        angle_between(vec_cast<double>(l.direction), axis) < angle_between(vec_cast<double>(nearest->direction), axis))
      nearest = &l;
  const double off = nearest == nullptr ? 180 : angle_between(vec_cast<double>(nearest->direction), axis) / kDegree;
  if (off > 5) {
    if (row.lost++ == 0) row.worst_case = where + ": lost";
    return;
  }
  if (off > row.worst_direction_deg) {
    row.worst_direction_deg = off;
    row.worst_case = where + ": " + std::to_string(off) + " degrees";
  }
  row.worst_energy = std::max(row.worst_energy, std::abs(nearest->irradiance.g / energy - 1));
}

Descriptor answer(Estimator& estimator, const Shot& shot, Tally& tally) {
  Descriptor d;
  if (!estimator.estimate(std::span(&shot.frame, 1), d).ok()) ++tally.refused;
  return d;
}

std::string text(Vec3d v) { return formatted("(%.6f, %.6f, %.6f)", v.x, v.y, v.z); }

/// Axes, oblique directions, and directions around the overlap of two back-to-back lenses of 95 degrees.
std::vector<Vec3d> special_places() {
  std::vector<Vec3d> out = {{0, 1, 0}, {0, -1, 0}, {1, 0, 0},       {-1, 0, 0},     {0, 0, -1},
                            {0, 0, 1}, {1, 1, 0},  {0.02, 1, 0.01}, {0.01, 0.3, 1}, {-0.01, -0.2, 1}};
  for (const double angle : {85.0, 89.0, 90.0, 91.0, 94.0, 94.9, 95.0, 95.1})
    for (const double azimuth : {7.0, 45.0, 133.0, 250.0}) {
      const double s = std::sin(angle * kDegree);
      out.push_back({s * std::cos(azimuth * kDegree), s * std::sin(azimuth * kDegree), -std::cos(angle * kDegree)});
    }
  for (Vec3d& v : out) v = normalized(v);
  return out;
}

}  // namespace

SpotRow hot_pixel(int places) {
  SpotRow row;
  for (const char* kind : {"pair", "equirect"}) {
    const RigRenderer renderer(std::string(kind) == "equirect" ? rig_of(kind, 320, 160) : rig_of(kind, 160, 120));
    const Pictures even = renderer.render(constant({1, 1, 1}));
    for (const EstimatorConfig& config : every_choice()) {
      const auto estimator = estimator_of(renderer.rig(), config);
      Chance chance(21);
      for (int i = 0; i < places;) {
        const auto k = static_cast<std::size_t>(chance.below(static_cast<int>(even.size())));
        const LensTable& lens = renderer.table().lenses[k];
        const auto pixel = static_cast<std::size_t>(chance.below(lens.width * lens.height));
        const auto level = static_cast<float>(chance.magnitude(1e3, 1e8));
        // Excludes the overlap, where a pixel counts only in part and the other lens would contradict it.
        if (!(lens.solid_angle[pixel] > 0) || lens.overlap_pixel[pixel] >= 0) continue;
        ++i;
        Pictures pictures = even;
        for (std::size_t c = 0; c < 3; ++c) pictures[k][3 * pixel + c] = level;
        const Descriptor d = answer(*estimator, renderer.as_floats(pictures), row.tally);
        const std::string where = std::string(kind) + ", " + name_of(config) + ", pixel " + std::to_string(pixel) +
                                  " of lens " + std::to_string(k) + ", " + std::to_string(level);
        row.tally.count(d, renderer.truth().normals(), renderer.truth().irradiance(pictures), where);
        evaluate_spot(d, vec_cast<double>(lens.direction[pixel]), static_cast<double>(level) * lens.solid_angle[pixel],
                      where, row);
      }
    }
  }
  return row;
}

const char* name_of(Place place) {
  switch (place) {
    case Place::pole:
      return "pole";
    case Place::seam:
      return "seam";
    case Place::lens_edge:
      return "lens_edge";
    case Place::between_lenses:
      return "between_lenses";
  }
  return "unknown";
}

namespace {

/// Energy of a disc in the pixels; near a pole of an equirectangular image it differs by a few percent from the
/// disc's.
double energy_of_pixels(const RigRenderer& renderer, const Pictures& with, const Pictures& without) {
  double sum = 0;
  for (std::size_t k = 0; k < with.size(); ++k)
    for (std::size_t i = 0; i < renderer.table().lenses[k].solid_angle.size(); ++i)
      sum +=
          static_cast<double>(with[k][3 * i + 1] - without[k][3 * i + 1]) * renderer.table().lenses[k].solid_angle[i];
  return sum;
}

std::vector<Vec3d> axes_of(Place place) {
  std::vector<Vec3d> axes;
  Chance chance(22);
  for (int i = 0; i < 6; ++i) {
    const double azimuth = chance.between(0, 360) * kDegree, near = i < 2 ? 0 : chance.between(-0.6, 0.6) * kDegree;
    const auto around = [&](double angle) {
      return Vec3d{std::sin(angle) * std::cos(azimuth), std::sin(angle) * std::sin(azimuth), -std::cos(angle)};
    };
    switch (place) {
      case Place::pole:
        axes.push_back({near * std::cos(azimuth), i % 2 == 0 ? 1.0 : -1.0, near * std::sin(azimuth)});
        break;
      case Place::seam:
        axes.push_back({near, 0.9 * std::sin(azimuth), 1});
        break;
      case Place::lens_edge:
        axes.push_back(around((i % 2 == 0 ? 95 : 85) * kDegree + near));
        break;
      case Place::between_lenses:
        axes.push_back(around(90 * kDegree + near));
        break;
    }
  }
  for (Vec3d& axis : axes) axis = normalized(axis);
  return axes;
}

}  // namespace

std::vector<SpotRow> suns(const char* kind, int width, std::span<const Place> places) {
  std::vector<SpotRow> rows(places.size());
  constexpr double kRadius = 0.25 * kDegree;
  const float level = radiance_times_mean(1e5, kRadius, 1);
  const RigRenderer renderer(rig_of(kind, width, std::string(kind) == "equirect" ? width / 2 : width * 3 / 4));
  const std::vector<EstimatorConfig> configs = every_choice();
  std::vector<std::unique_ptr<Estimator>> estimators;
  for (const EstimatorConfig& config : configs) estimators.push_back(estimator_of(renderer.rig(), config));
  const Pictures even = renderer.render(constant({1, 1, 1}));
  for (std::size_t p = 0; p < places.size(); ++p)
    for (const Vec3d& axis : axes_of(places[p])) {
      Pictures pictures = even;
      renderer.add({axis, kRadius, {level, level, level}}, pictures);
      const auto truth = renderer.truth().irradiance(pictures);
      const double energy = energy_of_pixels(renderer, pictures, even);
      const Shot shot = renderer.as_floats(pictures);
      for (std::size_t i = 0; i < configs.size(); ++i) {
        const Descriptor d = answer(*estimators[i], shot, rows[p].tally);
        const std::string where =
            std::string(kind) + " " + std::to_string(width) + ", " + name_of(configs[i]) + ", " + text(axis);
        rows[p].tally.count(d, renderer.truth().normals(), truth, where);
        evaluate_spot(d, axis, energy, where, rows[p]);
      }
    }
  return rows;
}

SpotRow light_direction(const RigParameters& rig, double diameter_deg, int anywhere, Setting setting) {
  SpotRow row;
  const RigRenderer renderer(rig);
  const auto estimator = estimator_of(rig, choice(setting, 0.01));
  const double radius = diameter_deg / 2 * kDegree;
  const Pictures even = renderer.render(constant({1, 1, 1}));
  std::vector<Vec3d> axes = special_places();
  Chance chance(23);
  for (int i = 0; i < anywhere; ++i) axes.push_back(chance.direction());
  for (const Vec3d& axis : axes) {
    Pictures pictures = even;
    renderer.add({axis, radius, {1000, 1000, 1000}}, pictures);
    const Descriptor d = answer(*estimator, renderer.as_floats(pictures), row.tally);
    const std::string where = std::to_string(diameter_deg) + " degrees at " + text(axis);
    row.tally.count(d, where);
    evaluate_spot(d, axis, 1001 * std::numbers::pi * std::sin(radius) * std::sin(radius), where, row);
  }
  return row;
}

}  // namespace lightwell::extremes
