#include "estimate/marker/light_search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/QR>

namespace lightwell::marker {
namespace {

constexpr int kDirections = 400;                                // spacing of 10 degrees
constexpr std::array kInverseDistances = {0.0, 0.8, 1.7, 3.3};  // 1/m: infinity, 1.25 m, 0.6 m, 0.3 m
/// Share of the mean irradiance that is assumed to be ambient, for the prior of its linear coefficients.
constexpr double kAmbientFraction = 0.3;
/// A disc is approximated by its middle and this many points around it, at this share of its radius.
constexpr int kDiscPoints = 6;
constexpr double kDiscPointRadius = 0.764;

/// The grid's directions, evenly spaced.
const std::vector<Vec3d>& grid() {
  static const std::vector<Vec3d> directions = fibonacci_directions(kDirections);
  return directions;
}

/// Subtracts the projection of x onto the span of an orthonormal basis.
void project(const Eigen::MatrixXd& basis, Eigen::VectorXd& x) { x -= basis * (basis.transpose() * x); }

/// Adds x to an orthonormal basis (Gram-Schmidt, twice for precision), unless it lies in its span.
void extend(Eigen::MatrixXd& basis, Eigen::VectorXd x) {
  const double norm_before = x.norm();
  project(basis, x);
  project(basis, x);
  if (!(x.norm() > 1e-6 * norm_before) || !(norm_before > 0)) return;
  basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
  basis.col(basis.cols() - 1) = x.normalized();
}

/// Whether a light of `a` is more than kMinSeparation_rad from all of `b`.
bool are_distinct(const LightSearch::Candidate& a, const LightSearch::Candidate& b) {
  for (const PointLight& x : a.lights) {
    double nearest = 10;
    for (const PointLight& y : b.lights) nearest = std::min(nearest, angle_between(x.direction, y.direction));
    if (nearest > kMinSeparation_rad) return true;
  }
  return false;
}

/// At most `most` candidates in ascending order of chi square, each distinct from all better ones.
std::vector<LightSearch::Candidate> best_of(std::vector<LightSearch::Candidate> all, std::size_t most) {
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.chi_square < b.chi_square; });
  std::vector<LightSearch::Candidate> out;
  for (const LightSearch::Candidate& one : all) {
    if (out.size() == most) break;
    if (std::all_of(out.begin(), out.end(), [&](const auto& other) { return are_distinct(one, other); }))
      out.push_back(one);
  }
  return out;
}

}  // namespace

/// `column_of(direction, inverse_distance)`: whitened response to a light there.
template <class ColumnOf>
void LightSearch::LinearSystem::fill_columns(const ColumnOf& column_of) {
  columns.resize(basis.rows(), static_cast<Eigen::Index>(grid().size() * kInverseDistances.size()));
  Eigen::Index at = 0;
  for (const Vec3d& direction : grid())
    for (const double w : kInverseDistances) columns.col(at++) = column_of(direction, w).template cast<float>();
  const Eigen::MatrixXf single = basis.cast<float>();
  columns -= single * (single.transpose() * columns);
}

/// Orthonormal basis of the responses to `lights`, projected off `basis`.
template <class ColumnOf>
Eigen::MatrixXd LightSearch::LinearSystem::basis_of(const std::vector<PointLight>& lights,
                                                    const ColumnOf& column_of) const {
  Eigen::MatrixXd out(columns.rows(), 0);
  for (const PointLight& light : lights) {
    Eigen::VectorXd column = column_of(light.direction, light.inverse_distance);
    project(basis, column);
    extend(out, column);
  }
  return out;
}

LightSearch::LightSearch(const Observations& observations, const std::vector<Vec3d>& hull)
    : observations_(observations), hull_(hull), face_systems_(static_cast<std::size_t>(observations.channels())) {
  const Eigen::Index n = observations.samples();
  for (int c = 0; c < observations.channels(); ++c) {
    LinearSystem& system = face_systems_[static_cast<std::size_t>(c)];
    system.basis.resize(n + 3, 0);
    for (int b = 0; b < 4; ++b) {
      Eigen::VectorXd column(n + 3);
      for (Eigen::Index i = 0; i < n; ++i) {
        const Vec3d& normal = observations.face_samples()[static_cast<std::size_t>(i)].normal;
        column[i] = b == 0 ? 1 : b == 1 ? normal.x : b == 2 ? normal.y : normal.z;
      }
      observations.whiten(c, column.head(n));
      column.tail<3>().setZero();
      if (b > 0)
        column[n + b - 1] =
            1 / (kAmbientGradientSigma * kAmbientFraction * std::max(observations.mean_irradiance(c), 1e-300));
      extend(system.basis, column);
    }
    system.residual = Eigen::VectorXd::Zero(n + 3);
    system.residual.head(n) = observations.whitened(c);
    project(system.basis, system.residual);
    system.fill_columns([&](Vec3d direction, double w) { return column_of(c, direction, w); });
  }
}

Eigen::VectorXd LightSearch::column_of(int channel, Vec3d direction, double inverse_distance) const {
  const Eigen::Index n = observations_.samples();
  Eigen::VectorXd column(n + 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const SurfaceSample& s = observations_.face_samples()[static_cast<std::size_t>(i)];
    column[i] = relative_irradiance(direction, inverse_distance, s);
  }
  observations_.whiten(channel, column.head(n));
  column.tail<3>().setZero();
  return column;
}

Eigen::VectorXd LightSearch::ground_column_of(Vec3d direction, double inverse_distance) {
  const GroundObservations& ground = *observations_.ground();
  if (!shadow_.compute_irradiance(ground, hull_, direction, inverse_distance, unit_irradiance_))
    return Eigen::VectorXd::Zero(ground.size());
  return ground.whitened(unit_irradiance_);
}

void LightSearch::build_ground_system() {
  if (ground_system_ || observations_.ground() == nullptr) return;
  const GroundObservations& ground = *observations_.ground();
  LinearSystem& system = ground_system_.emplace();
  system.basis.resize(ground.size(), 0);
  extend(system.basis, ground.whitened(ground.open));
  system.residual = ground.whitened(ground.radiance);
  project(system.basis, system.residual);
  system.fill_columns([&](Vec3d direction, double w) { return ground_column_of(direction, w); });
}

LightSearch::ChiSquareMap LightSearch::chi_square_map(ObservationSet observation_set,
                                                      const std::vector<PointLight>& fixed_lights) {
  const std::size_t places = grid().size() * kInverseDistances.size();
  std::vector<double> chi(places, 0);
  const auto add = [&](const LinearSystem& system, const auto& column_of_light) {
    const Eigen::MatrixXd extra = system.basis_of(fixed_lights, column_of_light);
    Eigen::VectorXd residual = system.residual;
    project(extra, residual);
    const double start = residual.squaredNorm();
    const Eigen::VectorXf along = system.columns.transpose() * residual.cast<float>();
    Eigen::VectorXf size = system.columns.colwise().squaredNorm().transpose();
    if (extra.cols() > 0)
      size -= (extra.cast<float>().transpose() * system.columns).colwise().squaredNorm().transpose();
    for (std::size_t i = 0; i < places; ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      const double gain = along[at] > 0 && size[at] > 1e-6F ? static_cast<double>(along[at]) * along[at] / size[at] : 0;
      chi[i] += std::max(0.0, start - gain);
    }
  };
  for (int c = 0; c < observations_.channels(); ++c)
    add(face_systems_[static_cast<std::size_t>(c)],
        [&](Vec3d direction, double w) { return column_of(c, direction, w); });
  if (observation_set == ObservationSet::faces_and_ground_plane && observations_.ground() != nullptr) {
    build_ground_system();
    add(*ground_system_, [&](Vec3d direction, double w) { return ground_column_of(direction, w); });
  }
  ChiSquareMap out{grid(), std::vector<double>(grid().size(), 1e300), std::vector<double>(grid().size(), 0),
                   4 * std::numbers::pi / kDirections};
  for (std::size_t i = 0; i < places; ++i) {
    const std::size_t direction = i / kInverseDistances.size();
    if (chi[i] < out.chi_square[direction])
      out.chi_square[direction] = chi[i],
      out.inverse_distance[direction] = kInverseDistances[i % kInverseDistances.size()];
  }
  return out;
}

double LightSearch::chi_square_of(const PointLight& light, double radius_rad,
                                  const std::vector<PointLight>& fixed_lights) const {
  const auto [u, v] = tangent_basis(light.direction);
  double chi = 0;
  for (int c = 0; c < observations_.channels(); ++c) {
    const LinearSystem& system = face_systems_[static_cast<std::size_t>(c)];
    // The middle and a ring around it, with the second moment of a uniform disc.
    Eigen::VectorXd column = column_of(c, light.direction, light.inverse_distance);
    for (int k = 0; k < kDiscPoints; ++k) {
      const double a = 2 * std::numbers::pi * k / kDiscPoints, off = radius_rad * kDiscPointRadius;
      const Vec3d direction = light.direction * std::cos(off) + (u * std::cos(a) + v * std::sin(a)) * std::sin(off);
      column += column_of(c, direction, light.inverse_distance);
    }
    const Eigen::MatrixXd extra =
        system.basis_of(fixed_lights, [&](Vec3d of_light, double w) { return column_of(c, of_light, w); });
    Eigen::VectorXd residual = system.residual;
    project(extra, residual);
    project(system.basis, column);
    project(extra, column);
    const double along = column.dot(residual), size = column.squaredNorm();
    chi += residual.squaredNorm() - (along > 0 && size > 1e-9 ? along * along / size : 0);
  }
  return chi;
}

std::vector<LightSearch::Candidate> LightSearch::find_single_lights(std::size_t most, ObservationSet observation_set,
                                                                    const std::vector<PointLight>& fixed_lights) {
  const ChiSquareMap map = chi_square_map(observation_set, fixed_lights);
  std::vector<Candidate> all;
  for (std::size_t i = 0; i < map.directions.size(); ++i)
    all.push_back({{PointLight{map.directions[i], map.inverse_distance[i], {}}}, map.chi_square[i]});
  return best_of(std::move(all), most);
}

std::vector<LightSearch::Candidate> LightSearch::find_light_pairs(std::size_t most, ObservationSet observation_set) {
  // Every second direction of the grid at infinity suffices: fits refine the pairs afterwards.
  const auto m = static_cast<Eigen::Index>((grid().size() + 1) / 2);
  const auto direction_at = [](Eigen::Index i) { return grid()[static_cast<std::size_t>(2 * i)]; };
  Eigen::MatrixXf chi = Eigen::MatrixXf::Zero(m, m);
  const auto add = [&](const LinearSystem& system) {
    Eigen::MatrixXf columns(system.columns.rows(), m);
    for (Eigen::Index i = 0; i < m; ++i)
      columns.col(i) = system.columns.col(2 * i * static_cast<Eigen::Index>(kInverseDistances.size()));
    const Eigen::MatrixXf gram = columns.transpose() * columns;
    const Eigen::VectorXf along = columns.transpose() * system.residual.cast<float>();
    const auto start = static_cast<float>(system.residual.squaredNorm());
    for (Eigen::Index a = 0; a < m; ++a)
      for (Eigen::Index b = a + 1; b < m; ++b) {
        const float aa = gram(a, a), bb = gram(b, b), ab = gram(a, b), det = aa * bb - ab * ab;
        const float only_a = aa > 1e-6F && along[a] > 0 ? along[a] * along[a] / aa : 0;
        const float only_b = bb > 1e-6F && along[b] > 0 ? along[b] * along[b] / bb : 0;
        float gain = std::max(only_a, only_b);
        if (det > 1e-4F * aa * bb) {
          const float x = (bb * along[a] - ab * along[b]) / det, y = (aa * along[b] - ab * along[a]) / det;
          if (x > 0 && y > 0) gain = x * along[a] + y * along[b];
        }
        chi(a, b) += start - gain;
      }
  };
  for (const LinearSystem& system : face_systems_) add(system);
  if (observation_set == ObservationSet::faces_and_ground_plane && observations_.ground() != nullptr) {
    build_ground_system();
    add(*ground_system_);
  }
  // Keeps the best partner for each first light.
  std::vector<Candidate> all;
  const double near = std::cos(kMinSeparation_rad);
  for (Eigen::Index a = 0; a < m; ++a) {
    const Vec3d x = direction_at(a);
    Candidate best{{}, 1e300};
    for (Eigen::Index b = a + 1; b < m; ++b) {
      const Vec3d y = direction_at(b);
      if (chi(a, b) < best.chi_square && dot(x, y) < near)
        best = {{PointLight{x, 0, {}}, PointLight{y, 0, {}}}, chi(a, b)};
    }
    if (!best.lights.empty()) all.push_back(std::move(best));
  }
  return best_of(std::move(all), most);
}

}  // namespace lightwell::marker
